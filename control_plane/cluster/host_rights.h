// A host may ask for all that is placed on it, and for nothing else. A join token says which host a new agent is, and
// from then on a certificate does; here is what that host has a part in.
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"

namespace tessera::control {

// The host whose join token this is; its next agent is admitted by it. UNAUTHENTICATED: there is none, or it has run
// out.
absl::StatusOr<const HostEntry*> HostOfJoinToken(const ClusterState& state, const std::string& token, Now now);

// OK if a region of an instance that uses the scene or game (SceneKey, GameKey) is placed on the host. `field`: names
// the request's hash. NOT_FOUND otherwise, whether there is such content or not.
absl::Status CheckMayFetchContent(const ClusterState& state, const std::string& host_id, const std::string& key,
                                  const char* field);
// OK if this region of the instance is placed on the host. NOT_FOUND otherwise, likewise.
absl::Status CheckMayFetchState(const ClusterState& state, const std::string& host_id, const std::string& instance_id,
                                std::uint32_t region);

}  // namespace tessera::control
