// Where regions can be placed now: hosts that take them, and plans for whole instances on those. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/placement.h"

namespace tessera::control {

// The needs that a region has of its host.
struct RegionNeeds {
  std::uint32_t threads = 1;
  std::string module = {};   // a native game that the host must have, or a library with a movement; empty: none
  std::string build = {};    // its hash; empty: any
  bool movement = false;     // for its movement, and not for its game
  std::string release = {};  // the worker's program is of this one; empty: any
};
RegionNeeds NeedsOf(const records::Instance& record);

// Hosts that take regions, with the number of such regions that each has room for: every thread takes a place. Hosts
// without the native game or without programs of the release are left out; one on which a worker has just found no free
// ports is to be avoided. Places of `without`, if given, count as free.
std::vector<FreeHost> FreeHosts(const ClusterState& state, const RegionNeeds& needs, const InstanceEntry* without);

// Those of them that were heard within `silence`: what is placed on a host that has just died waits in vain until the
// host counts as lost.
std::vector<FreeHost> HeardHosts(const ClusterState& state, const RegionNeeds& needs, const InstanceEntry* without,
                                 Steady silence, Now now);

// Places all regions of `map` on heard hosts if they have room, else on all that take regions: a busy machine is silent
// for a moment, too; on hosts to be avoided only if the others have no room. RESOURCE_EXHAUSTED when there is no room,
// FAILED_PRECONDITION where no host that takes regions has the native game; both name the hosts that lack it.
absl::StatusOr<PlacementPlan> PlaceAnew(const ClusterState& state, const PartitionMap& map, const RegionNeeds& needs,
                                        const InstanceEntry* without, Steady silence, Now now);

// `status`, with the hosts that take regions and lack the native game or programs of the release: "...; without
// native:arena@1a2b3c4d: beta (has no such game module)".
absl::Status NamingLackingHosts(const ClusterState& state, const RegionNeeds& needs, const absl::Status& status);

// The build of the needed library that all hosts have that take regions and can run it. FAILED_PRECONDITION names the
// hosts where none has one, or where they have different ones.
absl::StatusOr<std::string> BuildOfModule(const ClusterState& state, const RegionNeeds& needs);

}  // namespace tessera::control
