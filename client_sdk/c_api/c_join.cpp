// The C interface: joining through a control plane. It gets a grant and the scene there, and joins by them.
#include <string>

#include "client_sdk/c_api/connect.h"
#include "client_sdk/control_session.h"
#include "core/world/packed_scene.h"
#include "trust/control_address.h"

using namespace tessera;
using namespace tessera::c_api;

static_assert(TESSERA_MAX_TOKEN >= client::kMaxReturnTokenBytes);

namespace tessera::c_api {
namespace {

// Where a client that joined through a control plane leaves.
struct Door {
  trust::ControlPoint control;
  std::string instance_id;
  net::Credentials credentials;
};

tessera_code LeaveThrough(void* user, const uint8_t*, size_t, uint32_t deadline_ms) {
  const Door& door = *static_cast<const Door*>(user);
  return SetLastError(
      client::LeaveInstance(door.control, door.instance_id, door.credentials, std::chrono::milliseconds(deadline_ms)));
}

void FreeDoor(void* user) { delete static_cast<Door*>(user); }

absl::StatusOr<client::Session> JoinFor(const tessera_join_options& options) {
  return client::JoinInstance(ControlAddress(options.control_address),
                              {.instance_id = options.instance_id,
                               .player_name = options.player_name == nullptr ? "" : options.player_name,
                               .ticket = options.ticket == nullptr ? "" : options.ticket,
                               .returning = {options.returning, options.returning_size},
                               .watch = (options.flags & TESSERA_JOIN_WATCH) != 0,
                               .deadline = std::chrono::milliseconds(options.deadline_ms)});
}

tessera_code JoinThrough(const tessera_join_options& options, tessera_client** out) {
  const trust::ControlPoint control(ControlAddress(options.control_address));
  const auto session = JoinFor(options);
  if (!session.ok()) return SetLastError(session.status());
  const std::vector<std::uint8_t> grant = net::EncodeJoinGrant(client::GrantFrom(*session));
  const std::vector<std::uint8_t> scene = PackScene(*session->scene);
  tessera_grant_options by_grant = TESSERA_GRANT_OPTIONS;
  by_grant.deadline_ms = options.deadline_ms;
  by_grant.flags = options.flags & TESSERA_JOIN_PREDICT;
  by_grant.bind_address = options.bind_address;
  by_grant.scene = scene.data();
  by_grant.scene_size = scene.size();
  by_grant.on_leave = &LeaveThrough;
  by_grant.user = new Door{control, options.instance_id, session->credentials};
  by_grant.free_user = &FreeDoor;
  return tessera_join_grant(grant.data(), grant.size(), &by_grant, out);
}

}  // namespace

tessera_code SetLastError(const absl::Status& status) {
  if (status.ok()) return TESSERA_OK;
  return tessera_set_last_error(static_cast<tessera_code>(status.code()), std::string(status.message()).c_str());
}

tessera_code RefuseArgument(const char* what) { return tessera_set_last_error(TESSERA_INVALID_ARGUMENT, what); }

std::string ControlAddress(const char* given) {
  return given == nullptr || given[0] == '\0' ? "unix:" + trust::DefaultControlSocket() : given;
}

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
    const auto session = JoinFor(options);
    if (!session.ok()) return SetLastError(session.status());
    const std::vector<std::uint8_t> bytes = net::EncodeJoinGrant(client::GrantFrom(*session));
    if (bytes.size() <= capacity) std::memcpy(grant, bytes.data(), bytes.size());
    *size = bytes.size();
    return TESSERA_OK;
  } catch (const std::exception& thrown) {
    return tessera_set_last_error(TESSERA_INTERNAL, thrown.what());
  }
}
