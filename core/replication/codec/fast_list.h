// Fast lists: the bodies of a live datagram, each as its id, the samples that predict it, and a fast record.
//
//   std::vector<FastItem> items = ...;                          // ascending by id; records shared among clients
//   WriteFastList(writer, items);
//   ...
//   FastListReader list(reader);
//   while (list.Next(id, samples)) {                            // then find the samples, predict, and
//     if (!ReadPose(reader, prediction, base, limit, state)) return error;
//     if (list.has_velocities() && !state.asleep && !ReadVelocities(reader, ...)) return error;
//   }
//   if (!list.ok() || !reader.ok()) return error;
//
// Most clients acknowledge whole ticks, so mostly all bodies of a list have the same samples: then those are written
// once.
//
// clang-format off
//   list       count b(5 8 16); unless it is 0: velocities (0: none, 1 1: all, 1 0: each says), uniform 1, [samples]; bodies
//   body       id less the one before, less 1, b(0 2 5 7 12); unless uniform: 1: samples as before, or 0, samples;
//              [velocities 1]; record, and unless that says asleep, if it has them, velocities (velocity.h)
//   samples    ticks back to the base less 1, from base to older, from older to oldest (0: none), each b(3 6 12)
// clang-format on
//
// Thread rule: one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/replication/codec/fast_record.h"
#include "core/world/ids.h"

namespace tessera::replication {

// Which ticks predict a body: `ticks` before the datagram's, `gap` before that, `gap2` before that.
struct SampleTicks {
  std::uint64_t ticks = 0, gap = 0, gap2 = 0;  // ticks at least 1; gap2 0 where gap is
  friend bool operator==(const SampleTicks& a, const SampleTicks& b) {
    return ((a.ticks ^ b.ticks) | (a.gap ^ b.gap) | (a.gap2 ^ b.gap2)) == 0;
  }
};

struct FastItem {
  BodyId id;
  SampleTicks samples;
  PackedView record{};
  PackedView velocities{};  // no words: not written; no bits if the body sleeps
};

// Codes of the gaps between ids that most lists have; a gap is an id less the one before, less 1.
inline constexpr std::uint8_t kListGapBands[] = {0, 2, 5, 7, 12};
struct ShortCode {
  std::uint16_t code = 0;
  std::uint8_t bits = 0;
};
inline constexpr std::size_t kShortGaps = 1 + 4 + 32 + 128;
inline constexpr std::array<ShortCode, kShortGaps> kGapCodes = [] {
  std::array<ShortCode, kShortGaps> codes{};
  std::size_t first = 0;
  for (unsigned band = 0; first < kShortGaps; ++band) {
    const std::size_t size = std::size_t{1} << kListGapBands[band];
    for (std::size_t i = 0; i < size; ++i) {
      codes[first + i] = {static_cast<std::uint16_t>(i << (band + 1) | ((1u << band) - 1)),
                          static_cast<std::uint8_t>(band + 1 + kListGapBands[band])};
    }
    first += size;
  }
  return codes;
}();
int LongGapBits(std::uint64_t gap);
int SampleBits(const SampleTicks& samples);

// The most bits that an item adds to a list; it adds fewer where all items have the same samples.
inline int MaxBits(const FastItem& item, BodyId previous, const SampleTicks& previous_samples) {
  const std::uint64_t gap = item.id.value() - previous.value() - 1;
  return (gap < kShortGaps ? kGapCodes[gap].bits : LongGapBits(gap)) + 2 +
         (item.samples == previous_samples ? 0 : SampleBits(item.samples)) + item.record.bits + item.velocities.bits;
}
// The most bits of the list's head.
inline constexpr int kMaxListBits = 32;

void WriteFastList(BitWriter& writer, std::span<const FastItem> items);

class FastListReader {
 public:
  explicit FastListReader(BitReader& reader);
  // The next body's head; its record follows in the reader. False at the end and on an error.
  bool Next(BodyId& id, SampleTicks& samples);
  bool has_velocities() const { return velocities_; }  // whether the body that Next gave has them
  // False: ids do not ascend, or samples of no tick. Reading past the end shows in reader.ok().
  bool ok() const { return ok_; }

 private:
  bool ReadSamples();

  BitReader& reader_;
  std::uint64_t left_ = 0;
  bool uniform_ = false, some_velocities_ = false, all_velocities_ = false, velocities_ = false, ok_ = true;
  BodyId previous_;
  SampleTicks samples_;
};

}  // namespace tessera::replication
