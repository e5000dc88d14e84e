// The partition maps that a planned change and a failover go through.
//
// A planned change takes two maps. In the first, cells have their new owners and name the region whose bodies may still
// be there, so both exchange frames with every region whose bodies those could touch while they are handed over; the
// second, once nobody owns bodies in another's cells, drops those names. A failover takes one: the dead regions' cells
// go to their standbys.
//
//   auto first = TransitionMap(now, wanted, next_version);    // wanted: any map of the same bounds
//   auto second = SettledMap(*first, version_after);
//
// Thread rule: free functions on values.
#pragma once

#include <span>

#include "absl/status/statusor.h"
#include "core/world/partition_map.h"

namespace tessera {

// The map with every cell of `wanted`, cut along the cells of `now` that it takes from others. Epochs grow where the
// owner changes. Its regions are those of both maps; standbys are those of `wanted`, or of `now` for a region that is
// to go. INVALID_ARGUMENT: other bounds, a version that is not higher, `now` is itself in transition, more than
// kMaxCells pieces.
absl::StatusOr<PartitionMap> TransitionMap(const PartitionMap& now, const PartitionMap& wanted, MapVersion version);

// The same map without `from`. Adjoining cells of one owner become one where they form a rectangle, and regions without
// a cell are left out, as standbys too.
absl::StatusOr<PartitionMap> SettledMap(const PartitionMap& map, MapVersion version);

// True if a cell still names a region that it comes from.
bool InTransition(const PartitionMap& map);

// The map without the `dead` regions, given in any order. Their cells go to their standby, or on to its standby if that
// is dead too, or else to the region with the lowest id that lives; epochs grow there. A region whose standby died has
// none.
// INVALID_ARGUMENT: a region that is not in the map, none left, a version that is not higher.
absl::StatusOr<PartitionMap> FailoverMap(const PartitionMap& map, std::span<const RegionId> dead, MapVersion version);

}  // namespace tessera
