#include "core/world/partition_map.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"

namespace tessera {
namespace {

bool HasArea(const Rect& r) {
  // A finite width also rules out NaN, infinite edges and edges so far apart that their distance overflows.
  const double width = r.max_x - r.min_x, depth = r.max_z - r.min_z;
  return std::isfinite(width) && std::isfinite(depth) && width > 0 && depth > 0;
}

std::string Show(const Rect& r) {
  return absl::StrCat("x ", r.min_x, " to ", r.max_x, ", z ", r.min_z, " to ", r.max_z);
}

absl::Status Bad(const std::string& field, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat(field, ": ", what));
}

absl::Status CheckRegions(std::span<const MapRegion> regions) {
  if (regions.size() > kMaxRegions) return Bad("regions", absl::StrCat("at most ", kMaxRegions));
  std::vector<std::pair<RegionId, std::size_t>> ids;
  for (std::size_t i = 0; i < regions.size(); ++i) ids.emplace_back(regions[i].id, i);
  std::sort(ids.begin(), ids.end());
  const auto known = [&](RegionId id) {
    const auto it = std::lower_bound(ids.begin(), ids.end(), std::pair{id, std::size_t{0}});
    return it != ids.end() && it->first == id;
  };
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto field = absl::StrCat("regions[", ids[i].second, "].id");
    if (ids[i].first == RegionId()) return Bad(field, "must not be 0");
    if (i > 0 && ids[i].first == ids[i - 1].first) {
      return Bad(field, absl::StrCat(ids[i].first.value(), " is also that of regions[", ids[i - 1].second, "]"));
    }
  }
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const MapRegion& region = regions[i];
    const auto field = absl::StrCat("regions[", i, "].standby");
    if (region.standby == RegionId()) continue;
    if (region.standby == region.id)
      return Bad(field, absl::StrCat("region ", region.id.value(), " is its own standby"));
    if (!known(region.standby)) return Bad(field, absl::StrCat("there is no region ", region.standby.value()));
  }
  return absl::OkStatus();
}

// `regions` ascending by id.
absl::Status CheckCells(const Rect& bounds, std::span<const Cell> cells, std::span<const MapRegion> regions) {
  if (!HasArea(bounds)) return Bad("bounds", absl::StrCat("must be finite and have an area, got ", Show(bounds)));
  if (cells.empty()) return Bad("cells", "there must be at least one");
  if (cells.size() > kMaxCells) return Bad("cells", absl::StrCat("at most ", kMaxCells, ", got ", cells.size()));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Rect& area = cells[i].area;
    const auto field = absl::StrCat("cells[", i, "]");
    if (!HasArea(area)) return Bad(field + ".area", absl::StrCat("must be finite and have an area, got ", Show(area)));
    if (area.min_x < bounds.min_x || area.max_x > bounds.max_x || area.min_z < bounds.min_z ||
        area.max_z > bounds.max_z) {
      return Bad(field + ".area", absl::StrCat(Show(area), " is not inside bounds, ", Show(bounds)));
    }
    if (!std::ranges::binary_search(regions, cells[i].owner, {}, &MapRegion::id)) {
      return Bad(field + ".owner", absl::StrCat("there is no region ", cells[i].owner.value()));
    }
    const RegionId from = cells[i].from;
    if (from == RegionId()) continue;
    if (from == cells[i].owner) return Bad(field + ".from", absl::StrCat("region ", from.value(), " owns it"));
    if (!std::ranges::binary_search(regions, from, {}, &MapRegion::id)) {
      return Bad(field + ".from", absl::StrCat("there is no region ", from.value()));
    }
  }
  return absl::OkStatus();
}

double DistanceSquared(const Rect& r, Vec3d p) {
  const double dx = std::max({r.min_x - p.x, 0.0, p.x - r.max_x});
  const double dz = std::max({r.min_z - p.z, 0.0, p.z - r.max_z});
  return dx * dx + dz * dz;
}

}  // namespace

absl::StatusOr<PartitionMap> PartitionMap::Create(MapVersion version, Rect bounds, std::vector<Cell> cells,
                                                  std::vector<MapRegion> regions) {
  if (auto status = CheckRegions(regions); !status.ok()) return status;
  std::ranges::sort(regions, {}, &MapRegion::id);
  if (auto status = CheckCells(bounds, cells, regions); !status.ok()) return status;
  PartitionMap map;
  map.version_ = version;
  map.bounds_ = bounds;
  map.cells_ = std::move(cells);
  map.regions_ = std::move(regions);
  if (auto status = map.BuildIndex(); !status.ok()) return status;
  return map;
}

// Cuts the world along every z edge there is. Inside such a slab each cell spans the whole depth, so the cells cover it
// exactly once if and only if, sorted by min_x, each begins precisely where the one before it ends: no arithmetic, no
// epsilon.
absl::Status PartitionMap::BuildIndex() {
  std::vector<double> edges;
  for (const Cell& cell : cells_) edges.insert(edges.end(), {cell.area.min_z, cell.area.max_z});
  edges.insert(edges.end(), {bounds_.min_z, bounds_.max_z});
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());

  std::vector<std::uint32_t> by_min_x(cells_.size());
  for (std::uint32_t i = 0; i < by_min_x.size(); ++i) by_min_x[i] = i;
  std::ranges::sort(by_min_x, {}, [&](std::uint32_t i) { return std::pair(cells_[i].area.min_x, i); });

  slabs_.resize(edges.size() - 1);
  for (std::size_t s = 0; s < slabs_.size(); ++s) {
    slabs_[s].min_z = edges[s];
    if (auto status = FillSlab(slabs_[s], edges[s + 1], by_min_x); !status.ok()) return status;
  }

  for (const MapRegion& region : regions_) {
    owned_.first_of_region.push_back(static_cast<std::uint32_t>(owned_.cells.size()));
    may_hold_.first_of_region.push_back(static_cast<std::uint32_t>(may_hold_.cells.size()));
    for (std::uint32_t i = 0; i < cells_.size(); ++i) {
      const bool owns = cells_[i].owner == region.id;
      if (owns) owned_.cells.push_back(i);
      if (owns || cells_[i].from == region.id) may_hold_.cells.push_back(i);
    }
  }
  owned_.first_of_region.push_back(static_cast<std::uint32_t>(owned_.cells.size()));
  may_hold_.first_of_region.push_back(static_cast<std::uint32_t>(may_hold_.cells.size()));
  return absl::OkStatus();
}

absl::Status PartitionMap::FillSlab(Slab& slab, double max_z, std::span<const std::uint32_t> by_min_x) const {
  const auto strip = [&](double from, double to) { return Show({from, slab.min_z, to, max_z}); };
  double covered_to = bounds_.min_x;
  for (const std::uint32_t i : by_min_x) {
    const Rect& area = cells_[i].area;
    if (area.min_z > slab.min_z || area.max_z < max_z) continue;
    if (area.min_x > covered_to) return Bad("cells", absl::StrCat("no cell holds ", strip(covered_to, area.min_x)));
    if (area.min_x < covered_to) {
      return Bad(absl::StrCat("cells[", i, "].area"),
                 absl::StrCat("overlaps cells[", slab.cells.back(), "] in ",
                              strip(area.min_x, std::min(covered_to, area.max_x))));
    }
    slab.cells.push_back(i);
    covered_to = area.max_x;
  }
  if (covered_to < bounds_.max_x) {
    return Bad("cells", absl::StrCat("no cell holds ", strip(covered_to, bounds_.max_x)));
  }
  return absl::OkStatus();
}

PartitionMap PartitionMap::With(const WorldTerms& terms) const {
  PartitionMap map = *this;
  map.terms_ = terms;
  return map;
}

const MapRegion* PartitionMap::Find(RegionId region) const {
  const auto it = std::ranges::lower_bound(regions_, region, {}, &MapRegion::id);
  return it != regions_.end() && it->id == region ? &*it : nullptr;
}

// The slab that holds z; the first or last one beyond the ends.
std::size_t PartitionMap::SlabAt(double z) const {
  const auto after = std::upper_bound(slabs_.begin() + 1, slabs_.end(), z,
                                      [](double value, const Slab& slab) { return value < slab.min_z; });
  return static_cast<std::size_t>(after - slabs_.begin()) - 1;
}

// Where in slab.cells the cell that holds x is; the first or last one beyond the ends.
std::size_t PartitionMap::PlaceInSlab(const Slab& slab, double x) const {
  const auto after = std::upper_bound(slab.cells.begin() + 1, slab.cells.end(), x,
                                      [this](double value, std::uint32_t i) { return value < cells_[i].area.min_x; });
  return static_cast<std::size_t>(after - slab.cells.begin()) - 1;
}

const Cell& PartitionMap::CellAt(double x, double z) const {
  assert(!cells_.empty());
  if (!bounds_.Contains(x, z)) return NearestOutside(x, z);
  const Slab& slab = slabs_[SlabAt(z)];
  return cells_[slab.cells[PlaceInSlab(slab, x)]];
}

// The nearest cells are those whose closed rectangle holds the nearest point of the bounds: one, or the few that meet
// there.
const Cell& PartitionMap::NearestOutside(double x, double z) const {
  const double near_x = std::clamp(x, bounds_.min_x, bounds_.max_x);
  const double near_z = std::clamp(z, bounds_.min_z, bounds_.max_z);
  std::uint32_t first = std::numeric_limits<std::uint32_t>::max();
  const auto consider = [&](const Slab& slab) {
    const std::size_t place = PlaceInSlab(slab, near_x);
    first = std::min(first, slab.cells[place]);
    if (place > 0 && cells_[slab.cells[place]].area.min_x == near_x) first = std::min(first, slab.cells[place - 1]);
  };
  const std::size_t s = SlabAt(near_z);
  consider(slabs_[s]);
  if (s > 0 && slabs_[s].min_z == near_z) consider(slabs_[s - 1]);
  return cells_[first];
}

std::span<const std::uint32_t> PartitionMap::CellsOf(RegionId region, const RegionIndex& index) const {
  const MapRegion* const entry = Find(region);
  if (entry == nullptr) return {};
  const auto r = static_cast<std::size_t>(entry - regions_.data());
  const std::uint32_t first = index.first_of_region[r];
  return std::span(index.cells).subspan(first, index.first_of_region[r + 1] - first);
}

double PartitionMap::DistanceTo(RegionId region, Vec3d position) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : CellsOf(region, owned_))
    nearest = std::min(nearest, DistanceSquared(cells_[i].area, position));
  return std::sqrt(nearest);
}

bool PartitionMap::Reaches(RegionId region, const Aabb& box) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : CellsOf(region, may_hold_)) {
    // A cell is nearest to everything straight out from its share of the world's edge.
    Rect nearest = cells_[i].area;
    if (nearest.min_x == bounds_.min_x) nearest.min_x = -kFar;
    if (nearest.min_z == bounds_.min_z) nearest.min_z = -kFar;
    if (nearest.max_x == bounds_.max_x) nearest.max_x = kFar;
    if (nearest.max_z == bounds_.max_z) nearest.max_z = kFar;
    if (nearest.Touches(box)) return true;
  }
  return false;
}

std::vector<RegionId> PartitionMap::Neighbors(RegionId region) const {
  std::vector<RegionId> neighbors;
  for (const std::uint32_t mine : CellsOf(region, may_hold_)) {
    for (const Cell& other : cells_) {
      if (!cells_[mine].area.Touches(other.area)) continue;
      for (const RegionId holder : {other.owner, other.from}) {
        if (holder != region && holder != RegionId()) neighbors.push_back(holder);
      }
    }
  }
  std::ranges::sort(neighbors);
  neighbors.erase(std::unique(neighbors.begin(), neighbors.end()), neighbors.end());
  return neighbors;
}

absl::StatusOr<PartitionMap> MakeGridMap(Rect bounds, std::uint32_t n) {
  if (n < 1 || n > kMaxRegions) return Bad("regions", absl::StrCat("must be 1 to ", kMaxRegions, ", got ", n));
  if (!HasArea(bounds)) return Bad("bounds", absl::StrCat("must be finite and have an area, got ", Show(bounds)));
  std::uint32_t columns = 1;
  while (columns * columns < n) ++columns;
  const std::uint32_t rows = (n + columns - 1) / columns;
  // Edge i of `count` parts; the last one is the bound itself, not a rounded sum.
  const auto edge = [](double from, double to, std::uint32_t i, std::uint32_t count) {
    return i == count ? to : from + (to - from) * (static_cast<double>(i) / count);
  };
  std::vector<Cell> cells;
  std::vector<MapRegion> regions;
  for (std::uint32_t id = 1; id <= n; ++id) {
    const std::uint32_t row = (id - 1) / columns, column = (id - 1) % columns;
    const std::uint32_t in_row = row + 1 < rows ? columns : n - columns * (rows - 1);
    const Rect area{edge(bounds.min_x, bounds.max_x, column, in_row), edge(bounds.min_z, bounds.max_z, row, rows),
                    edge(bounds.min_x, bounds.max_x, column + 1, in_row),
                    edge(bounds.min_z, bounds.max_z, row + 1, rows)};
    cells.push_back({area, RegionId(id), Epoch(1)});
    regions.push_back({RegionId(id), n == 1 ? RegionId() : RegionId(id % n + 1)});
  }
  return PartitionMap::Create(MapVersion(1), bounds, std::move(cells), std::move(regions));
}

}  // namespace tessera
