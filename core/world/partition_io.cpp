#include "core/world/partition_io.h"

#include <algorithm>
#include <utility>

#include "core/world/map_bytes.h"

namespace tessera {

v1::Rect ToProto(const Rect& rect) {
  v1::Rect out;
  out.set_min_x(rect.min_x);
  out.set_min_z(rect.min_z);
  out.set_max_x(rect.max_x);
  out.set_max_z(rect.max_z);
  return out;
}

Rect FromProto(const v1::Rect& rect) { return {rect.min_x(), rect.min_z(), rect.max_x(), rect.max_z()}; }

v1::PartitionMap ToProto(const PartitionMap& map) {
  v1::PartitionMap out;
  out.set_version(map.version().value());
  *out.mutable_bounds() = ToProto(map.bounds());
  for (const Cell& cell : map.cells()) {
    v1::Cell& added = *out.add_cells();
    *added.mutable_area() = ToProto(cell.area);
    added.set_owner(cell.owner.value());
    added.set_epoch(cell.epoch.value());
    added.set_from(cell.from.value());
  }
  for (const MapRegion& region : map.regions()) {
    v1::MapRegion& added = *out.add_regions();
    added.set_id(region.id.value());
    added.set_standby(region.standby.value());
  }
  if (map.terms() != WorldTerms()) *out.mutable_terms() = ToProto(map.terms());
  return out;
}

v1::WorldTerms ToProto(const WorldTerms& terms) {
  v1::WorldTerms out;
  out.set_paused(terms.paused);
  out.set_ticks_per_second(terms.ticks_per_second);
  out.set_game(terms.game);
  return out;
}

absl::StatusOr<WorldTerms> FromProto(const v1::WorldTerms& terms) {
  const WorldTerms read{.paused = terms.paused(), .ticks_per_second = terms.ticks_per_second(), .game = terms.game()};
  if (absl::Status status = CheckTerms(read); !status.ok()) return status;
  return read;
}

absl::StatusOr<PartitionMap> FromProto(const v1::PartitionMap& map) {
  if (map.version() == 0) return absl::InvalidArgumentError("version: must not be 0");
  const absl::StatusOr<WorldTerms> terms = FromProto(map.terms());
  if (!terms.ok()) return terms.status();
  std::vector<Cell> cells;
  cells.reserve(static_cast<std::size_t>(map.cells_size()));
  for (const v1::Cell& cell : map.cells()) {
    cells.push_back({FromProto(cell.area()), RegionId(cell.owner()), Epoch(cell.epoch()), RegionId(cell.from())});
  }
  std::vector<MapRegion> regions;
  regions.reserve(static_cast<std::size_t>(map.regions_size()));
  for (const v1::MapRegion& region : map.regions())
    regions.push_back({RegionId(region.id()), RegionId(region.standby())});
  absl::StatusOr<PartitionMap> made =
      PartitionMap::Create(MapVersion(map.version()), FromProto(map.bounds()), std::move(cells), std::move(regions));
  if (!made.ok()) return made.status();
  return made->With(*terms);
}

const v1::MapRegion* FindRegion(const v1::PartitionMap& map, RegionId region) {
  const auto found = std::ranges::find(map.regions(), region.value(), &v1::MapRegion::id);
  return found == map.regions().end() ? nullptr : &*found;
}

}  // namespace tessera
