// Regions in a row from west to east, each 10 m wide: the first has x from 0 to 10. For tests of what crosses several
// borders.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/world/partition_map.h"

namespace tessera::region {

inline PartitionMap RowMap(std::uint32_t regions, double half_depth_m = 10) {
  std::vector<Cell> cells;
  std::vector<MapRegion> list;
  for (std::uint32_t i = 0; i < regions; ++i) {
    cells.push_back({{10.0 * i, -half_depth_m, 10.0 * (i + 1), half_depth_m}, RegionId(i + 1), Epoch(1)});
    list.push_back({RegionId(i + 1), RegionId(i + 1 < regions ? i + 2 : 1)});
  }
  return *PartitionMap::Create(MapVersion(1), {0, -half_depth_m, 10.0 * regions, half_depth_m}, std::move(cells),
                               std::move(list));
}

}  // namespace tessera::region
