// PartitionMap: who should own what part of the world.
//
// A list of cells, axis-aligned rectangles over x-z that cover the world's bounds exactly once, each with its owner region and
// that owner's fencing epoch; and the regions, each with its heir. One type serves the grid, a balanced k-d tree and a failover,
// where a region comes to own several cells. A map is a value: a change makes a new one with a higher version.
//
// A position outside the bounds belongs to the nearest cell (the earliest in the list on a tie), so every position in space
// has exactly one owner.
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/bounds.h"
#include "core/world/ids.h"

namespace tessera {

struct Cell {
  Rect area;
  RegionId owner;
  Epoch epoch;  // fencing: messages of an owner with a lower epoch for this cell are refused
  friend bool operator==(const Cell&, const Cell&) = default;
};

struct MapRegion {
  RegionId id;
  RegionId heir;  // who carries the region on if it dies; RegionId() when it has none
  friend bool operator==(const MapRegion&, const MapRegion&) = default;
};

class PartitionMap {
 public:
  PartitionMap() = default;

  // Checks and adopts. Errors (INVALID_ARGUMENT, naming the field, e.g. "cells[2].owner"): no cell, a cell without area or not
  // finite, cells that overlap or leave a hole in `bounds`, an owner or heir that is not in `regions`, a region that
  // appears twice, is 0 or is its own heir.
  static absl::StatusOr<PartitionMap> Create(MapVersion version, Rect bounds, std::vector<Cell> cells,
                                             std::vector<MapRegion> regions);

  MapVersion version() const { return version_; }
  const Rect& bounds() const { return bounds_; }
  std::span<const Cell> cells() const { return cells_; }
  std::span<const MapRegion> regions() const { return regions_; }  // ascending by id

  // The cell that holds (x, z): total, see above. Both finite.
  const Cell& CellAt(double x, double z) const;
  RegionId OwnerOf(Vec3d position) const { return CellAt(position.x, position.z).owner; }

  // Distance in x-z from `position` to the nearest cell of `region`, metres; 0 inside. Infinity if it owns no cell.
  double DistanceTo(RegionId region, Vec3d position) const;
  // True if `box` meets a cell of `region` (closed; and beyond the bounds where that region's cells are the nearest ones).
  bool Reaches(RegionId region, const Aabb& box) const;
  // Regions other than `region` with a cell that meets one of its cells, in an edge or a corner; ascending. Symmetric.
  std::vector<RegionId> Neighbors(RegionId region) const;

  friend bool operator==(const PartitionMap&, const PartitionMap&) = default;

 private:
  MapVersion version_;
  Rect bounds_;
  std::vector<Cell> cells_;
  std::vector<MapRegion> regions_;
};

// The dissertation's Algorithm 2 with its faults mended. n regions, ids 1..n, one cell each: columns = ceil(sqrt(n)), rows =
// ceil(n / columns); every full row has `columns` cells, the last row shares its whole width among the cells that remain, and
// the last row and column end exactly on the bounds. Heirs: each region's is the next one (n > 1), epochs 1, version 1.
// Errors: INVALID_ARGUMENT "regions" unless 1 <= n <= kMaxRegions, "bounds" unless finite with area.
absl::StatusOr<PartitionMap> MakeGridMap(Rect bounds, std::uint32_t n);

}  // namespace tessera
