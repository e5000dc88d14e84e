#include "core/world/map_bytes.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"

namespace tessera {
namespace {

// The least that a cell and a region take.
constexpr std::size_t kMinCellBytes = 4 * 8 + 3, kMinMapRegionBytes = 2;

void WriteRect(const Rect& rect, ByteWriter& out) {
  for (const double edge : {rect.min_x, rect.min_z, rect.max_x, rect.max_z}) out.F64(edge);
}

Rect ReadRect(ByteReader& in) {
  const double min_x = in.F64(), min_z = in.F64(), max_x = in.F64(), max_z = in.F64();
  return {min_x, min_z, max_x, max_z};
}

WorldTerms ReadTerms(ByteReader& in) {
  WorldTerms terms;
  in.Field("terms.paused");
  const std::uint8_t paused = in.U8();
  if (paused > 1) in.Fail("is neither 0 nor 1");
  terms.paused = paused == 1;
  in.Field("terms.ticks_per_second");
  terms.ticks_per_second = in.F64();
  in.Field("terms.game");
  terms.game = in.Varint32();
  return terms;
}

}  // namespace

absl::Status CheckTerms(const WorldTerms& terms) {
  const double pace = terms.ticks_per_second;
  if (pace == 0 || (pace >= kMinTicksPerSecond && pace <= kMaxTickRateHz)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("terms.ticks_per_second: ", pace));
}

void WriteMap(const PartitionMap& map, ByteWriter& out) {
  out.Varint(map.version().value());
  WriteRect(map.bounds(), out);
  out.Varint(map.cells().size());
  for (const Cell& cell : map.cells()) {
    WriteRect(cell.area, out);
    out.Varint(cell.owner.value());
    out.Varint(cell.epoch.value());
    out.Varint(cell.from.value());
  }
  out.Varint(map.regions().size());
  for (const MapRegion& region : map.regions()) {
    out.Varint(region.id.value());
    out.Varint(region.standby.value());
  }
  out.U8(map.terms().paused ? 1 : 0);
  out.F64(map.terms().ticks_per_second);
  out.Varint(map.terms().game);
}

absl::StatusOr<PartitionMap> ReadMap(ByteReader& in) {
  in.Field("version");
  const MapVersion version(in.Varint());
  if (version == MapVersion()) in.Fail("must not be 0");
  in.Field("bounds");
  const Rect bounds = ReadRect(in);
  in.Field("cells");
  std::vector<Cell> cells(in.Count(kMinCellBytes));
  for (Cell& cell : cells) {
    in.Field("cells.area");
    cell.area = ReadRect(in);
    in.Field("cells.owner");
    cell.owner = RegionId(in.Varint32());
    in.Field("cells.epoch");
    cell.epoch = Epoch(in.Varint32());
    in.Field("cells.from");
    cell.from = RegionId(in.Varint32());
  }
  in.Field("regions");
  std::vector<MapRegion> regions(in.Count(kMinMapRegionBytes));
  for (MapRegion& region : regions) {
    in.Field("regions.id");
    region.id = RegionId(in.Varint32());
    in.Field("regions.standby");
    region.standby = RegionId(in.Varint32());
  }
  const WorldTerms terms = ReadTerms(in);
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  if (absl::Status status = CheckTerms(terms); !status.ok()) return status;
  absl::StatusOr<PartitionMap> map = PartitionMap::Create(version, bounds, std::move(cells), std::move(regions));
  if (!map.ok()) return map.status();
  return map->With(terms);
}

}  // namespace tessera
