// Where regions can be placed now: hosts that take them, and plans for whole instances on those. Pure.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/placement.h"

namespace tessera::control {

// Hosts that take regions, with the number of regions of `threads` threads that each has room for: every thread takes a
// place. Places of `without`, if given, count as free.
std::vector<FreeHost> FreeHosts(const ClusterState& state, std::uint32_t threads, const InstanceEntry* without);

// Those of them that were heard within `silence`: what is placed on a host that has just died waits in vain until the
// host counts as lost.
std::vector<FreeHost> HeardHosts(const ClusterState& state, std::uint32_t threads, const InstanceEntry* without,
                                 Steady silence, Now now);

// Places all regions of `map` on heard hosts if they have room, else on all that take regions: a busy machine is silent
// for a moment, too. RESOURCE_EXHAUSTED when there is no room.
absl::StatusOr<PlacementPlan> PlaceAnew(const ClusterState& state, const PartitionMap& map, std::uint32_t threads,
                                        const InstanceEntry* without, Steady silence, Now now);

}  // namespace tessera::control
