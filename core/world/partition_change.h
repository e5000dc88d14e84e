// From one partition map to the next: the maps that a planned change and a failover go through.
//
// A planned change takes two maps. In the first, cells have their new owners and name the region whose bodies may still
// be there, so both exchange frames with all whom those bodies could touch while they are handed over; the second,
// once nobody owns bodies in another's cells, drops those names. A failover takes one: the dead regions' cells go to
// their heirs.
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

// Every cell of `wanted`, cut along the cells of `now` that it takes from others. Epochs grow where the owner changes.
// Its regions are those of both; heirs as in `wanted`, or as in `now` for a region that is to go. INVALID_ARGUMENT:
// other bounds, a version that is not higher, `now` is itself not settled, more than kMaxCells pieces.
absl::StatusOr<PartitionMap> TransitionMap(const PartitionMap& now, const PartitionMap& wanted, MapVersion version);

// The same without `from`, adjoining cells of one owner made one again where they form a rectangle, regions without a
// cell left out (and heirs that were such).
absl::StatusOr<PartitionMap> SettledMap(const PartitionMap& map, MapVersion version);

// True if a cell still names a region that it comes from.
bool InTransition(const PartitionMap& map);

// `dead` regions (any order) are gone. What they own goes to their heir, or on to the heir's if that is dead too, or to
// the region with the lowest id that lives; epochs grow there. Regions whose heir died have none. INVALID_ARGUMENT: a
// region that is not in the map, none left, a version that is not higher.
absl::StatusOr<PartitionMap> FailoverMap(const PartitionMap& map, std::span<const RegionId> dead, MapVersion version);

}  // namespace tessera
