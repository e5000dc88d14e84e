// The C interface: the worlds that a control plane runs.
#include <algorithm>
#include <cstring>

#include "client_sdk/c_api/connect.h"
#include "client_sdk/connect/door_session.h"
#include "client_sdk/include/tessera/connect.h"

using namespace tessera;
using namespace tessera::c_api;

namespace {

static_assert(TESSERA_MAX_LISTED_INSTANCES == client::kMostDoorInstances);
static_assert(TESSERA_MAX_LISTED_PLAYERS == client::kMostDoorNames);
static_assert(TESSERA_MAX_LISTED_NAME == client::kMostDoorText);
static_assert(TESSERA_MAX_CONTROL_ADDRESSES == client::kMostDoorAddresses);

template <std::size_t kRoom>
void CopyText(const std::string& from, char (&to)[kRoom]) {
  const std::size_t size = std::min(from.size(), kRoom - 1);
  std::memcpy(to, from.data(), size);
  to[size] = '\0';
}

tessera_instance_info InfoFrom(const client::DoorInstance& from) {
  tessera_instance_info info = TESSERA_INSTANCE_INFO;
  info.state = from.state;
  info.regions = from.regions;
  info.players = from.players;
  info.expected_players = from.expected_players;
  CopyText(from.id, info.id);
  CopyText(from.scene, info.scene);
  CopyText(from.game, info.game);
  info.name_count = static_cast<uint32_t>(from.names.size());
  for (std::size_t i = 0; i < from.names.size(); ++i) CopyText(from.names[i], info.player_names[i]);
  return info;
}

}  // namespace

tessera_code tessera_list_instances(const char* control_address, uint32_t deadline_ms, tessera_instance_info* instances,
                                    size_t stride, size_t capacity, size_t* count) {
  if (count == nullptr) return RefuseArgument("count: is NULL");
  *count = 0;
  if (capacity > 0 && instances == nullptr) return RefuseArgument("instances: is NULL");
  constexpr std::size_t kLeast = offsetof(tessera_instance_info, scene);
  if (capacity > 0 && !IsAtLeast(stride, kLeast, "stride")) return TESSERA_INVALID_ARGUMENT;
  try {
    const auto addresses = client::ParseDoorAddresses(control_address == nullptr ? "" : control_address);
    if (!addresses.ok()) return SetLastError(addresses.status());
    const auto listed = client::ListByDoor(*addresses, std::chrono::milliseconds(deadline_ms));
    if (!listed.ok()) return SetLastError(listed.status());
    for (std::size_t i = 0; i < std::min(capacity, listed->size()); ++i) {
      tessera_instance_info info = InfoFrom((*listed)[i]);
      info.size = static_cast<uint32_t>(stride);
      std::memcpy(reinterpret_cast<char*>(instances) + i * stride, &info, std::min(stride, sizeof info));
    }
    *count = listed->size();
    return TESSERA_OK;
  } catch (const std::exception& thrown) {
    return tessera_set_last_error(TESSERA_INTERNAL, thrown.what());
  }
}
