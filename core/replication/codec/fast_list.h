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

#include <span>

#include "core/replication/codec/fast_record.h"
#include "core/world/ids.h"

namespace tessera::replication {

// Which ticks predict a body: `ticks` before the datagram's, `gap` before that, `gap2` before that.
struct SampleTicks {
  std::uint64_t ticks = 0, gap = 0, gap2 = 0;  // ticks at least 1; gap2 0 where gap is
  friend bool operator==(const SampleTicks&, const SampleTicks&) = default;
};

struct FastItem {
  BodyId id;
  SampleTicks samples;
  PackedView record{};
  PackedView velocities{};  // no words: not written; no bits if the body sleeps
};

// The most bits that an item adds to a list; it adds fewer where all items have the same samples.
int MaxBits(const FastItem& item, BodyId previous, const SampleTicks& previous_samples);
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
