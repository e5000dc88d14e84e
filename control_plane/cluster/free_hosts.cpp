#include "control_plane/cluster/free_hosts.h"

#include <algorithm>

#include "control_plane/cluster/hosts.h"

namespace tessera::control {

std::vector<FreeHost> FreeHosts(const ClusterState& state, const InstanceEntry* without) {
  std::vector<FreeHost> free;
  for (const auto& [number, host] : state.hosts()) {
    if (StateOf(host) != v1::HOST_STATE_READY) continue;
    const auto taken = std::count_if(host.workers.begin(), host.workers.end(), [without](const auto& worker) {
      return without == nullptr || worker.first != without->number;
    });
    const std::uint32_t capacity = CapacityOf(host);
    free.push_back({host.record.id(), capacity > taken ? capacity - static_cast<std::uint32_t>(taken) : 0});
  }
  return free;
}

std::vector<FreeHost> HeardHosts(const ClusterState& state, const InstanceEntry* without, Steady silence, Now now) {
  std::vector<FreeHost> heard = FreeHosts(state, without);
  std::erase_if(heard,
                [&](const FreeHost& host) { return now.steady - state.FindHost(host.id)->last_heard > silence; });
  return heard;
}

absl::StatusOr<PlacementPlan> PlaceAnew(const ClusterState& state, const PartitionMap& map,
                                        const InstanceEntry* without, Steady silence, Now now) {
  auto placed = Place(map, HeardHosts(state, without, silence, now));
  return placed.ok() ? std::move(placed) : Place(map, FreeHosts(state, without));
}

}  // namespace tessera::control
