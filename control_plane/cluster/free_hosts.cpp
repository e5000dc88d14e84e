#include "control_plane/cluster/free_hosts.h"

#include "control_plane/cluster/hosts.h"
#include "control_plane/instance_record.h"

namespace tessera::control {

std::vector<FreeHost> FreeHosts(const ClusterState& state, std::uint32_t threads, const InstanceEntry* without) {
  std::vector<FreeHost> free;
  for (const auto& [number, host] : state.hosts()) {
    if (StateOf(host) != v1::HOST_STATE_READY) continue;
    std::uint32_t taken = 0;
    for (const auto& [instance, index] : host.workers) {
      if (without != nullptr && instance == without->number) continue;
      taken += RegionThreadsOf(state.instances().at(instance).record);
    }
    const std::uint32_t capacity = CapacityOf(host);
    free.push_back({host.record.id(), capacity > taken ? (capacity - taken) / threads : 0});
  }
  return free;
}

std::vector<FreeHost> HeardHosts(const ClusterState& state, std::uint32_t threads, const InstanceEntry* without,
                                 Steady silence, Now now) {
  std::vector<FreeHost> heard = FreeHosts(state, threads, without);
  std::erase_if(heard,
                [&](const FreeHost& host) { return now.steady - state.FindHost(host.id)->last_heard > silence; });
  return heard;
}

absl::StatusOr<PlacementPlan> PlaceAnew(const ClusterState& state, const PartitionMap& map, std::uint32_t threads,
                                        const InstanceEntry* without, Steady silence, Now now) {
  auto placed = Place(map, HeardHosts(state, threads, without, silence, now));
  return placed.ok() ? std::move(placed) : Place(map, FreeHosts(state, threads, without));
}

}  // namespace tessera::control
