// The C interface: joining through a control plane. It gets a grant there, and joins by it.
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/c_api/connect.h"
#include "client_sdk/connect/door_session.h"
#include "client_sdk/include/tessera/connect.h"

using namespace tessera;
using namespace tessera::c_api;

namespace tessera::c_api {
namespace {

// Where a client that joined through a control plane leaves.
struct Door {
  std::vector<client::DoorAddress> addresses;
  std::string instance_id;
};

tessera_code LeaveThrough(void* user, const uint8_t* token, size_t size, uint32_t deadline_ms) {
  const Door& door = *static_cast<const Door*>(user);
  try {
    return SetLastError(
        client::LeaveByDoor(door.addresses, door.instance_id, {token, size}, std::chrono::milliseconds(deadline_ms)));
  } catch (const std::exception& thrown) {
    return tessera_set_last_error(TESSERA_INTERNAL, thrown.what());
  }
}

void FreeDoor(void* user) { delete static_cast<Door*>(user); }

struct Joined {
  std::vector<std::uint8_t> grant;
  std::unique_ptr<Door> door;
};

absl::StatusOr<Joined> JoinFor(const tessera_join_options& options) {
  auto addresses = client::ParseDoorAddresses(options.control_address == nullptr ? "" : options.control_address);
  if (!addresses.ok()) return addresses.status();
  auto grant = client::JoinByDoor(*addresses, {.instance_id = options.instance_id,
                                               .player_name = options.player_name == nullptr ? "" : options.player_name,
                                               .ticket = options.ticket == nullptr ? "" : options.ticket,
                                               .returning = {options.returning, options.returning_size},
                                               .watch = (options.flags & TESSERA_JOIN_WATCH) != 0,
                                               .deadline = std::chrono::milliseconds(options.deadline_ms)});
  if (!grant.ok()) return grant.status();
  return Joined{*std::move(grant), std::make_unique<Door>(Door{*std::move(addresses), options.instance_id})};
}

tessera_code JoinThrough(const tessera_join_options& options, tessera_client** out) {
  auto joined = JoinFor(options);
  if (!joined.ok()) return SetLastError(joined.status());
  tessera_grant_options by_grant = TESSERA_GRANT_OPTIONS;
  by_grant.deadline_ms = options.deadline_ms;
  by_grant.flags = options.flags & TESSERA_JOIN_PREDICT;
  by_grant.bind_address = options.bind_address;
  by_grant.on_leave = &LeaveThrough;
  by_grant.user = joined->door.release();
  by_grant.free_user = &FreeDoor;
  return tessera_join_grant(joined->grant.data(), joined->grant.size(), &by_grant, out);
}

}  // namespace
}  // namespace tessera::c_api

namespace {

// The program's options, and for what it does not know the usual ones.
tessera_code TakeOptions(const tessera_join_options* given, tessera_join_options& options) {
  if (given == nullptr) return RefuseArgument("options: is NULL");
  constexpr std::size_t kLeast = offsetof(tessera_join_options, bind_address);
  if (!IsAtLeast(given->size, kLeast, "options.size")) return TESSERA_INVALID_ARGUMENT;
  std::memcpy(static_cast<void*>(&options), given, std::min<std::size_t>(given->size, sizeof options));
  if (options.instance_id == nullptr) return RefuseArgument("options.instance_id: is NULL");
  if (options.returning_size > TESSERA_MAX_TOKEN) {
    return RefuseArgument("options.returning_size: more than a token has");
  }
  if (options.returning_size > 0 && options.returning == nullptr) return RefuseArgument("options.returning: is NULL");
  return TESSERA_OK;
}

}  // namespace

tessera_code tessera_join(const tessera_join_options* given, tessera_client** out) {
  if (out == nullptr) return RefuseArgument("client: is NULL");
  *out = nullptr;
  tessera_join_options options = TESSERA_JOIN_OPTIONS;
  if (const tessera_code code = TakeOptions(given, options); code != TESSERA_OK) return code;
  try {
    return JoinThrough(options, out);
  } catch (const std::exception& thrown) {
    return tessera_set_last_error(TESSERA_INTERNAL, thrown.what());
  }
}

tessera_code tessera_get_grant(const tessera_join_options* given, void* grant, size_t capacity, size_t* size) {
  if (size == nullptr) return RefuseArgument("size: is NULL");
  *size = 0;
  if (grant == nullptr && capacity > 0) return RefuseArgument("grant: is NULL");
  tessera_join_options options = TESSERA_JOIN_OPTIONS;
  if (const tessera_code code = TakeOptions(given, options); code != TESSERA_OK) return code;
  try {
    const auto joined = JoinFor(options);
    if (!joined.ok()) return SetLastError(joined.status());
    const std::vector<std::uint8_t>& bytes = joined->grant;
    if (bytes.size() <= capacity) std::memcpy(grant, bytes.data(), bytes.size());
    *size = bytes.size();
    return TESSERA_OK;
  } catch (const std::exception& thrown) {
    return tessera_set_last_error(TESSERA_INTERNAL, thrown.what());
  }
}
