#include "core/replication/codec/fast_list.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>

namespace tessera::replication {
namespace {

constexpr std::uint8_t kCountBands[] = {5, 8, 16};
constexpr std::uint8_t kListGapBands[] = {0, 2, 5, 7, 12};
constexpr std::uint8_t kTickBands[] = {3, 6, 12};

void WriteSamples(BitWriter& writer, const SampleTicks& samples) {
  assert(samples.ticks >= 1 && (samples.gap != 0 || samples.gap2 == 0));
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

int SampleBits(const SampleTicks& samples) {
  return BandedBits(samples.ticks - 1, kTickBands) + BandedBits(samples.gap, kTickBands) +
         BandedBits(samples.gap2, kTickBands);
}

}  // namespace

int MaxBits(const FastItem& item, BodyId previous, const SampleTicks& previous_samples) {
  return BandedBits(item.id.value() - previous.value() - 1, kListGapBands) + 2 +
         (item.samples == previous_samples ? 0 : SampleBits(item.samples)) + item.record.bits + item.velocities.bits;
}

void WriteFastList(BitWriter& writer, std::span<const FastItem> items) {
  writer.WriteBanded(items.size(), kCountBands);
  if (items.empty()) return;
  const auto has = [](const FastItem& i) { return i.velocities.words != nullptr; };
  const bool some_velocities = std::any_of(items.begin(), items.end(), has);
  const bool all_velocities = some_velocities && std::all_of(items.begin(), items.end(), has);
  writer.WriteBit(some_velocities);
  if (some_velocities) writer.WriteBit(all_velocities);
  const bool uniform =
      std::all_of(items.begin(), items.end(), [&](const FastItem& i) { return i.samples == items[0].samples; });
  writer.WriteBit(uniform);
  if (uniform) WriteSamples(writer, items[0].samples);
  BodyId previous;
  SampleTicks samples;
  for (const FastItem& item : items) {
    assert(item.id > previous);
    writer.WriteBanded(item.id.value() - previous.value() - 1, kListGapBands);
    previous = item.id;
    if (!uniform) {
      writer.WriteBit(item.samples == samples);
      if (item.samples != samples) WriteSamples(writer, item.samples);
      samples = item.samples;
    }
    if (some_velocities && !all_velocities) writer.WriteBit(has(item));
    item.record.AppendTo(writer);
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
