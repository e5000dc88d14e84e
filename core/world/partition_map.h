// PartitionMap: the parts of the world and the regions that should own them.
//
// A list of cells, axis-aligned rectangles over x-z that cover the world's bounds exactly once, each with its owner
// region and that owner's fencing epoch; and the regions, each with its standby. One type serves the grid, a balanced
// k-d tree and a failover, where a region comes to own several cells. A map is a value: a change makes a new one with a
// higher version.
//
// A position outside the bounds belongs to the nearest cell (the earliest in the list on a tie), so every position in
// space has exactly one owner.
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/bounds.h"
#include "core/world/ids.h"
#include "core/world/world_terms.h"

namespace tessera {

struct Cell {
  Rect area;
  RegionId owner;
  Epoch epoch;  // fencing: messages of an owner with a lower epoch for this cell are refused
  // The region whose bodies may still be here while a planned map takes effect; RegionId() when there is none.
  RegionId from{};
  friend bool operator==(const Cell&, const Cell&) = default;
};

struct MapRegion {
  RegionId id;
  RegionId standby;  // carries the region on if it dies; RegionId() when there is none
  friend bool operator==(const MapRegion&, const MapRegion&) = default;
};

class PartitionMap {
 public:
  PartitionMap() = default;

  // Checks the parts and makes a map of them. Errors (INVALID_ARGUMENT, naming the field, e.g. "cells[2].owner"): no
  // cell, a cell without area or not finite, cells that overlap or leave a hole in `bounds`, an owner or standby that
  // is not in `regions`, a region that appears twice, is 0 or is its own standby; more than kMaxCells cells or
  // kMaxRegions regions.
  static absl::StatusOr<PartitionMap> Create(MapVersion version, Rect bounds, std::vector<Cell> cells,
                                             std::vector<MapRegion> regions);

  // The same map with other terms.
  PartitionMap With(const WorldTerms& terms) const;

  MapVersion version() const { return version_; }
  const WorldTerms& terms() const { return terms_; }
  const Rect& bounds() const { return bounds_; }
  std::span<const Cell> cells() const { return cells_; }
  std::span<const MapRegion> regions() const { return regions_; }  // ascending by id
  // The entry of a region; null if the map does not have it. One binary search.
  const MapRegion* Find(RegionId region) const;
  bool HasRegion(RegionId region) const { return Find(region) != nullptr; }

  // The cell that holds (x, z), which may lie anywhere, see above. Both are finite and the map is not a default-made
  // one. Two binary searches.
  const Cell& CellAt(double x, double z) const;
  RegionId OwnerOf(Vec3d position) const { return CellAt(position.x, position.z).owner; }

  // Distance in x-z from `position` to the nearest cell of `region`, metres; 0 inside. Infinity if it owns no cell.
  double DistanceTo(RegionId region, Vec3d position) const;
  // True if `box` meets a cell that `region` owns or that comes from it (closed; and beyond the bounds where those
  // cells are the nearest ones).
  bool Reaches(RegionId region, const Aabb& box) const;
  // Regions other than `region` with a cell that meets one of its cells, in an edge or a corner, or is one; ascending.
  // Symmetric. A cell counts for its owner and for the region that it comes from.
  std::vector<RegionId> Neighbors(RegionId region) const;

  friend bool operator==(const PartitionMap&, const PartitionMap&) = default;

 private:
  // A strip of the world between two neighbouring z edges of cells, and the cells that cross it, from west to east.
  struct Slab {
    double min_z = 0;
    std::vector<std::uint32_t> cells;  // ascending by min_x; adjoining, as `Create` has checked
    friend bool operator==(const Slab&, const Slab&) = default;
  };
  absl::Status BuildIndex();
  absl::Status FillSlab(Slab& slab, double max_z, std::span<const std::uint32_t> crossing) const;
  std::size_t SlabAt(double z) const;
  std::size_t PlaceInSlab(const Slab& slab, double x) const;
  const Cell& NearestOutside(double x, double z) const;
  // Cells by region, in the order of regions_.
  struct RegionIndex {
    std::vector<std::uint32_t> cells;
    std::vector<std::uint32_t> first_of_region;  // into `cells`; one more than regions_
    friend bool operator==(const RegionIndex&, const RegionIndex&) = default;
  };
  std::span<const std::uint32_t> CellsOf(RegionId region, const RegionIndex& index) const;

  MapVersion version_;
  WorldTerms terms_;
  Rect bounds_;
  std::vector<Cell> cells_;
  std::vector<MapRegion> regions_;
  // Indices, which follow from the above.
  std::vector<Slab> slabs_;
  RegionIndex owned_;     // cells that the region owns
  RegionIndex may_hold_;  // and cells that come from it
};

// The dissertation's Algorithm 2 with its faults mended. n regions, ids 1..n, one cell each: columns = ceil(sqrt(n)),
// rows = ceil(n / columns); every full row has `columns` cells, the last row shares its whole width among the cells
// that remain, and the last row and column end exactly on the bounds. Standbys: each region's is the next one (n > 1),
// epochs 1, version 1. Errors: INVALID_ARGUMENT "regions" unless 1 <= n <= kMaxRegions, "bounds" unless finite with
// area.
absl::StatusOr<PartitionMap> MakeGridMap(Rect bounds, std::uint32_t n);

}  // namespace tessera
