#include "core/world/partition_change.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"

namespace tessera {
namespace {

absl::Status Bad(const std::string& what) { return absl::InvalidArgumentError(what); }

absl::Status CheckVersion(const PartitionMap& now, MapVersion version) {
  if (version > now.version()) return absl::OkStatus();
  return Bad(absl::StrCat("version: must be above ", now.version().value(), ", got ", version.value()));
}

Rect Common(const Rect& a, const Rect& b) {
  return {std::max(a.min_x, b.min_x), std::max(a.min_z, b.min_z), std::min(a.max_x, b.max_x),
          std::min(a.max_z, b.max_z)};
}

bool IsNotEmpty(const Rect& r) { return r.min_x < r.max_x && r.min_z < r.max_z; }

// Makes `a` the rectangle that the two form together; false if they form none.
bool Join(Rect& a, const Rect& b) {
  if (a.min_z == b.min_z && a.max_z == b.max_z && (a.max_x == b.min_x || b.max_x == a.min_x)) {
    a = {std::min(a.min_x, b.min_x), a.min_z, std::max(a.max_x, b.max_x), a.max_z};
    return true;
  }
  if (a.min_x == b.min_x && a.max_x == b.max_x && (a.max_z == b.min_z || b.max_z == a.min_z)) {
    a = {a.min_x, std::min(a.min_z, b.min_z), a.max_x, std::max(a.max_z, b.max_z)};
    return true;
  }
  return false;
}

bool JoinInto(Cell& cell, const Cell& other) {
  if (cell.owner != other.owner || cell.from != other.from || !Join(cell.area, other.area)) return false;
  cell.epoch = std::max(cell.epoch, other.epoch);
  return true;
}

// Joins cells until no two of one owner form a rectangle.
void JoinAll(std::vector<Cell>& cells) {
  for (bool joined = true; joined;) {
    joined = false;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      for (std::size_t j = i + 1; j < cells.size();) {
        if (JoinInto(cells[i], cells[j])) {
          cells.erase(cells.begin() + static_cast<std::ptrdiff_t>(j));
          joined = true;
        } else {
          ++j;
        }
      }
    }
  }
}

}  // namespace

absl::StatusOr<PartitionMap> TransitionMap(const PartitionMap& now, const PartitionMap& wanted, MapVersion version) {
  if (absl::Status status = CheckVersion(now, version); !status.ok()) return status;
  if (!(now.bounds() == wanted.bounds())) return Bad("bounds: not those of the map that is in force");
  if (InTransition(now)) return Bad("the map that is in force is still in transition");
  std::vector<Cell> cells;
  for (const Cell& to : wanted.cells()) {
    for (const Cell& old : now.cells()) {
      const Rect area = Common(to.area, old.area);
      if (!IsNotEmpty(area)) continue;
      const bool kept = to.owner == old.owner;
      cells.push_back({area, to.owner, kept ? old.epoch : Epoch(old.epoch.value() + 1), kept ? RegionId() : old.owner});
      if (cells.size() > kMaxCells) return Bad(absl::StrCat("cells: more than ", kMaxCells, " pieces"));
    }
  }
  JoinAll(cells);
  std::vector<MapRegion> regions(wanted.regions().begin(), wanted.regions().end());
  for (const MapRegion& region : now.regions()) {
    if (!wanted.HasRegion(region.id)) regions.push_back(region);
  }
  return PartitionMap::Create(version, now.bounds(), std::move(cells), std::move(regions));
}

absl::StatusOr<PartitionMap> SettledMap(const PartitionMap& map, MapVersion version) {
  if (absl::Status status = CheckVersion(map, version); !status.ok()) return status;
  std::vector<Cell> cells(map.cells().begin(), map.cells().end());
  for (Cell& cell : cells) cell.from = RegionId();
  JoinAll(cells);
  const auto has_cell = [&](RegionId id) {
    return std::any_of(cells.begin(), cells.end(), [id](const Cell& cell) { return cell.owner == id; });
  };
  std::vector<MapRegion> regions;
  for (MapRegion region : map.regions()) {
    if (!has_cell(region.id)) continue;
    if (!has_cell(region.standby)) region.standby = RegionId();
    regions.push_back(region);
  }
  return PartitionMap::Create(version, map.bounds(), std::move(cells), std::move(regions));
}

bool InTransition(const PartitionMap& map) {
  return std::any_of(map.cells().begin(), map.cells().end(), [](const Cell& cell) { return cell.from != RegionId(); });
}

absl::StatusOr<PartitionMap> FailoverMap(const PartitionMap& map, std::span<const RegionId> dead, MapVersion version) {
  if (absl::Status status = CheckVersion(map, version); !status.ok()) return status;
  const auto died = [&](RegionId id) { return std::find(dead.begin(), dead.end(), id) != dead.end(); };
  std::vector<MapRegion> regions;
  for (const RegionId id : dead) {
    if (!map.HasRegion(id)) return Bad(absl::StrCat("dead: there is no region ", id.value()));
  }
  for (MapRegion region : map.regions()) {
    if (died(region.id)) continue;
    if (died(region.standby)) region.standby = RegionId();
    regions.push_back(region);
  }
  if (regions.empty()) return Bad("dead: no region would be left");
  const auto successor = [&](RegionId id) {
    for (std::size_t hops = 0; hops <= map.regions().size() && id != RegionId(); ++hops) {
      if (!died(id)) return id;
      id = map.Find(id)->standby;
    }
    return regions.front().id;
  };
  std::vector<Cell> cells(map.cells().begin(), map.cells().end());
  for (Cell& cell : cells) {
    if (died(cell.owner)) {
      cell.owner = successor(cell.owner);
      cell.epoch = Epoch(cell.epoch.value() + 1);
    }
    if (died(cell.from)) cell.from = successor(cell.from);
    if (cell.from == cell.owner) cell.from = RegionId();
  }
  JoinAll(cells);
  return PartitionMap::Create(version, map.bounds(), std::move(cells), std::move(regions));
}

}  // namespace tessera
