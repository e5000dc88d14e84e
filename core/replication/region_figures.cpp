#include "core/replication/region_figures.h"

#include <limits>

#include "absl/strings/str_cat.h"
#include "core/replication/datagram.h"
#include "core/world/bytes.h"

namespace tessera::replication {
namespace {

constexpr std::uint64_t kKib = 1024;

// All that follows the tick, in its order on the wire: reader and writer go through the same list.
template <class Figures, class Number, class Memory>
void EachFigure(Figures& figures, Number number, Memory memory) {
  number(figures.owned);
  number(figures.ghosts);
  number(figures.asleep);
  number(figures.clients);
  for (auto* work :
       {&figures.step, &figures.physics, &figures.prediction, &figures.snapshot_full, &figures.snapshot_delta}) {
    number(work->count);
    number(work->total_ns);
  }
  memory(figures.memory.process_virtual_bytes);
  memory(figures.memory.process_physical_bytes);
  memory(figures.memory.host_virtual_usable_bytes);
  memory(figures.memory.host_virtual_total_bytes);
  memory(figures.memory.host_physical_usable_bytes);
  memory(figures.memory.host_physical_total_bytes);
}

}  // namespace

std::vector<std::uint8_t> EncodeRegionFigures(const RegionFigures& figures) {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(DatagramKind::kRegionFigures));
  out.U8(kRegionFiguresFormat);
  out.Varint(figures.tick.value());
  EachFigure(
      figures, [&](std::uint64_t number) { out.Varint(number); },
      [&](std::uint64_t bytes) { out.Varint(bytes / kKib); });
  return out.Take();
}

absl::StatusOr<RegionFigures> DecodeRegionFigures(std::span<const std::uint8_t> datagram) {
  ByteReader in(datagram);
  in.Field("figures.kind");
  if (in.U8() != static_cast<std::uint8_t>(DatagramKind::kRegionFigures) && in.ok()) in.Fail("not of figures");
  in.Field("figures.format");
  const std::uint8_t format = in.U8();
  if (in.ok() && format != kRegionFiguresFormat) {
    return absl::InvalidArgumentError(absl::StrCat("figures: format ", format, ", expected ", kRegionFiguresFormat));
  }
  in.Field("figures.tick");
  RegionFigures figures;
  figures.tick = Tick(in.Varint());
  if (figures.tick.value() > kMaxTick) in.Fail("out of range");
  in.Field("figures");
  EachFigure(
      figures, [&](std::uint64_t& number) { number = in.Varint(); },
      [&](std::uint64_t& bytes) {
        const std::uint64_t kib = in.Varint();
        if (kib > std::numeric_limits<std::uint64_t>::max() / kKib) in.Fail("out of range");
        bytes = kib * kKib;
      });
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  if (in.remaining() != 0) return absl::InvalidArgumentError("figures: trailing bytes");
  return figures;
}

}  // namespace tessera::replication
