// Which release of the worker's program a world runs with. All of its workers have one, since those of two releases
// refuse each other's links; hosts keep the programs of the releases that their worlds need. A world keeps its release
// until it is upgraded, whatever is installed meanwhile.
//
// Thread rule: as Cluster.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/cluster/free_hosts.h"
#include "control_plane/now.h"
#include "control_plane/placement.h"
#include "core/world/partition_map.h"

namespace tessera::control {

// Those of which the host has the worker's program. One whose agent lists none has that of its agent; empty: it does
// not say which that is.
std::vector<std::string> ReleasesOf(const records::Host& host);
// Whether workers of this release can start there. An empty one is any, and a host that says none may have it.
bool HasRelease(const records::Host& host, const std::string& release);

// For a world that begins, or begins anew in all of its regions.
enum class ReleaseChoice {
  kCommon,  // that of which most hosts that take regions have programs; of equally common ones the newest
  kKept,    // its own one; if no host that takes regions has it any more, as kCommon
  kNewest,  // the newest that a host has, and none older than its own
};

struct BeginningPlan {
  PlacementPlan placed;
  std::string release;  // empty: the hosts say none
};

// Places all regions of `map` with the first release, by `choice`, for which hosts have room. The world's own release
// is that of `needs`. Errors: those of PlaceAnew for the release that is chosen first.
absl::StatusOr<BeginningPlan> PlaceBeginning(const ClusterState& state, const PartitionMap& map,
                                             const RegionNeeds& needs, const InstanceEntry* without,
                                             ReleaseChoice choice, Steady silence, Now now);

// Gives the record this release. An event says so if it had another one.
void SetRelease(const std::string& release, Now now, records::Instance& record);

// Worlds of a control plane that knew of no releases yet run with programs of kFirstRelease. UNAVAILABLE: it cannot be
// stored.
absl::Status GiveReleases(ClusterState& state);

}  // namespace tessera::control
