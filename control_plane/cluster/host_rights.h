// A host may ask for all that is placed on it, and for nothing else. A host's certificate says which host it is; here
// is what that host has a part in.
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "control_plane/cluster/cluster_state.h"

namespace tessera::control {

// OK if a region of an instance that uses the scene or game (SceneKey, GameKey) is placed on the host. `field`: names
// the request's hash. NOT_FOUND otherwise, whether there is such content or not.
absl::Status CheckMayFetchContent(const ClusterState& state, const std::string& host_id, const std::string& key,
                                  const char* field);
// OK if this region of the instance is placed on the host. NOT_FOUND otherwise, likewise.
absl::Status CheckMayFetchState(const ClusterState& state, const std::string& host_id, const std::string& instance_id,
                                std::uint32_t region);

}  // namespace tessera::control
