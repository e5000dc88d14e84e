#include "core/replication/codec/fast_list.h"

#include <bit>
#include <cassert>
#include <limits>

namespace tessera::replication {
namespace {

constexpr std::uint8_t kCountBands[] = {5, 8, 16};
constexpr std::uint8_t kTickBands[] = {3, 6, 12};

void WriteSamples(BitWriter& writer, const SampleTicks& samples) {
  assert(samples.ticks >= 1 && (samples.gap != 0 || samples.gap2 == 0));
  constexpr int kShort = 1 + kTickBands[0];
  if (((samples.ticks - 1) | samples.gap | samples.gap2) >> kTickBands[0] == 0) {
    return writer.Write((samples.ticks - 1) << 1 | samples.gap << (1 + kShort) | samples.gap2 << (1 + 2 * kShort),
                        3 * kShort);
  }
  writer.WriteBanded(samples.ticks - 1, kTickBands);
  writer.WriteBanded(samples.gap, kTickBands);
  writer.WriteBanded(samples.gap2, kTickBands);
}

int BandedBits(std::uint64_t value, Bands bands) {
  int prefix = 0;
  for (const std::uint8_t width : bands) {
    const std::uint64_t size = std::uint64_t{1} << width;
    ++prefix;
    if (value < size) return prefix + width;
    value -= size;
  }
  return prefix + 8 * (1 + (static_cast<int>(std::bit_width(value | 1)) - 1) / 7);
}

}  // namespace

int LongGapBits(std::uint64_t gap) { return BandedBits(gap, kListGapBands); }

int SampleBits(const SampleTicks& samples) {
  return BandedBits(samples.ticks - 1, kTickBands) + BandedBits(samples.gap, kTickBands) +
         BandedBits(samples.gap2, kTickBands);
}

void WriteFastList(BitWriter& writer, std::span<const FastItem> items) {
  writer.WriteBanded(items.size(), kCountBands);
  if (items.empty()) return;
  const auto has = [](const FastItem& i) { return i.velocities.words != nullptr; };
  std::size_t with_velocities = 0;
  bool uniform = true;
  for (const FastItem& item : items) {
    with_velocities += has(item) ? 1 : 0;
    uniform &= item.samples == items[0].samples;
  }
  const bool some_velocities = with_velocities > 0, all_velocities = with_velocities == items.size();
  writer.WriteBit(some_velocities);
  if (some_velocities) writer.WriteBit(all_velocities);
  writer.WriteBit(uniform);
  if (uniform) WriteSamples(writer, items[0].samples);
  BodyId previous;
  SampleTicks samples;
  for (const FastItem& item : items) {
    assert(item.id > previous);
    // All that goes before the record is gathered, to be written with it.
    std::uint64_t head = 0;
    int bits = 0;
    const std::uint64_t gap = item.id.value() - previous.value() - 1;
    if (gap < kShortGaps) {
      head = kGapCodes[gap].code;
      bits = kGapCodes[gap].bits;
    } else {
      writer.WriteBanded(gap, kListGapBands);
    }
    previous = item.id;
    if (!uniform) {
      const bool same = item.samples == samples;
      head |= std::uint64_t{same} << bits++;
      if (!same) {
        writer.Write(head, bits);
        head = 0;
        bits = 0;
        WriteSamples(writer, item.samples);
        samples = item.samples;
      }
    }
    if (some_velocities && !all_velocities) head |= std::uint64_t{has(item)} << bits++;
    if (item.record.bits > 0 && item.record.bits <= 64 - bits) {
      writer.Write(head | item.record.words[0] << bits, bits + item.record.bits);
    } else {
      writer.Write(head, bits);
      item.record.AppendTo(writer);
    }
    item.velocities.AppendTo(writer);
  }
}

FastListReader::FastListReader(BitReader& reader) : reader_(reader) {
  left_ = reader_.ReadBanded(kCountBands);
  if (left_ == 0) return;
  some_velocities_ = reader_.ReadBit();
  all_velocities_ = some_velocities_ && reader_.ReadBit();
  uniform_ = reader_.ReadBit();
  if (uniform_) ok_ = ReadSamples();
}

bool FastListReader::ReadSamples() {
  samples_.ticks = reader_.ReadBanded(kTickBands);
  samples_.gap = reader_.ReadBanded(kTickBands);
  samples_.gap2 = reader_.ReadBanded(kTickBands);
  if (samples_.ticks == std::numeric_limits<std::uint64_t>::max()) return false;
  ++samples_.ticks;
  return samples_.gap != 0 || samples_.gap2 == 0;
}

bool FastListReader::Next(BodyId& id, SampleTicks& samples) {
  if (!ok_ || !reader_.ok() || left_ == 0) return false;
  --left_;
  const std::uint64_t gap = reader_.ReadBanded(kListGapBands);
  ok_ = gap < std::numeric_limits<std::uint64_t>::max() - previous_.value();
  if (!ok_) return false;
  previous_ = BodyId(previous_.value() + gap + 1);
  if (!uniform_ && !reader_.ReadBit()) ok_ = ReadSamples();
  ok_ = ok_ && samples_.ticks != 0;
  velocities_ = all_velocities_ || (some_velocities_ && reader_.ReadBit());
  id = previous_;
  samples = samples_;
  return ok_ && reader_.ok();
}

}  // namespace tessera::replication
