// Heirs: which region carries which on. Pure.
//
// A heir is on another host if there is one, then a neighbour, then the one that is heir to the fewest, then the next
// by id. One that is as good as any stays, since its copy is warm.
#pragma once

#include <functional>
#include <string>

#include "core/world/partition_map.h"

namespace tessera::control {

using HostOfRegion = std::function<std::string(RegionId)>;  // host id; empty: not known

// The same map with an heir for each region; without one where it is the only region.
absl::StatusOr<PartitionMap> WithHeirs(const PartitionMap& map, const HostOfRegion& host_of);

}  // namespace tessera::control
