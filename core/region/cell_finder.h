// CellFinder: PartitionMap::CellAt for one place after another, most of which lie in the cell of the one before.
//
//   CellFinder cells(map);
//   for (const OwnedBody& body : owned) cells.At(body.state.position).owner;
//
// Gives what CellAt gives. The map must outlive it, unchanged. Thread rule: one thread at a time.
#pragma once

#include <algorithm>

#include "core/world/partition_map.h"

namespace tessera::region {

class CellFinder {
 public:
  explicit CellFinder(const PartitionMap& map) : map_(map) {}

  // Cells do not overlap, so the last one is the answer wherever it holds the place.
  const Cell& At(Vec3d place) {
    if (last_ == nullptr || !last_->area.Contains(place.x, place.z)) last_ = &map_.CellAt(place.x, place.z);
    return *last_;
  }

 private:
  const PartitionMap& map_;
  const Cell* last_ = nullptr;
};

// How far inside the cell the place is, m; negative outside.
inline double InsideOf(const Cell& cell, Vec3d place) {
  const Rect& area = cell.area;
  return std::min({place.x - area.min_x, area.max_x - place.x, place.z - area.min_z, area.max_z - place.z});
}

}  // namespace tessera::region
