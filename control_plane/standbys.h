// Standbys: which region carries which on if it dies. Pure.
//
// A standby is on another host if there is one, then a neighbour, then the region that is standby to the fewest, then
// the next by id. A standby that is as good as any stays, since its copy is warm.
#pragma once

#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/control_records.pb.h"
#include "core/world/partition_map.h"

namespace tessera::control {

using HostOfRegion = std::function<std::string(RegionId)>;  // host id; empty: not known

// By the record's placements. The result owns what it needs.
HostOfRegion HostsOf(const records::Instance& record);

// The region's standby by the map in force, 0: none. A newcomer's comes from the planned map, so that it has one before
// it steps: it acknowledges nothing that it was granted before its standby has it.
std::uint32_t StandbyOf(const records::Instance& record, std::uint32_t region);

// True if `standby` cannot carry `region` on, because those two do not hear each other.
using CutBetween = std::function<bool(RegionId region, RegionId standby)>;

// The same map with a standby for each region, unless there is only one. One that is cut from its region is taken only
// where nobody else is left.
absl::StatusOr<PartitionMap> WithStandbys(const PartitionMap& map, const HostOfRegion& host_of, const CutBetween& cut);

}  // namespace tessera::control
