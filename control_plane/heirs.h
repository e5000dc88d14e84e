// Heirs: which region carries which on. Pure.
//
// A heir is on another host if there is one, then a neighbour, then the one that is heir to the fewest, then the next
// by id. One that is as good as any stays, since its copy is warm.
#pragma once

#include <functional>
#include <string>

#include "control_plane/control_records.pb.h"
#include "core/world/partition_map.h"

namespace tessera::control {

using HostOfRegion = std::function<std::string(RegionId)>;  // host id; empty: not known

// By the map in force; a newcomer's by the planned one, so that it has one before it steps: what it takes in is
// confirmed to nobody before the heir has it. 0: none.
std::uint32_t HeirOf(const records::Instance& record, std::uint32_t region);

// The same map with an heir for each region; without one where it is the only region. `cut`: the first cannot be
// carried on by the second, as those two do not hear each other, and is only where nobody else is left.
using CutBetween = std::function<bool(RegionId region, RegionId heir)>;
absl::StatusOr<PartitionMap> WithHeirs(const PartitionMap& map, const HostOfRegion& host_of, const CutBetween& cut);

}  // namespace tessera::control
