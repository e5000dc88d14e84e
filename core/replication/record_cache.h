// RecordCache: the records packed since the last push, to be shared by all clients that have acknowledged the same
// ticks.
//
//   cache.Begin(slots);                               // forgets all
//   cache.Prefetch(key);                              // some time before:
//   RecordCache::Place place = cache.Find(key);       // kNowhere: nobody has asked for it yet
//   if (place == RecordCache::kNowhere) place = cache.Add(key);
//   if (!cache.pose(place).here()) cache.set_pose(place, cache.Store(packed));
//   RecordCache::Record pose = cache.pose(place);
//   PackedView bits = cache.View(pose);               // valid while `pose` is, and until the next Store
//
// A thousand clients look up tens of thousands of records a snapshot, so the cost is the memory that a look-up touches.
// Clients go through bodies in the order of their slots, so the records of a slot lie together: in blocks of a few,
// those first that were asked for first, which are those that most clients need. Most records lie in their block
// because they fit a word. Thread rule: one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/replication/codec/fast_record.h"

namespace tessera::replication {

class RecordCache {
 public:
  // A slot's present state against its states at three ticks.
  struct Key {
    static constexpr int kTickBits = 20, kGapBits = 6;
    static_assert(kTickBits + 2 * kGapBits == 32);
    std::uint32_t slot = 0;
    std::uint32_t ticks = 0;         // back to the base; 0: a full record
    std::uint8_t gap = 0, gap2 = 0;  // 0: there is none
    // All but the slot.
    std::uint32_t packed() const {
      return ticks << (2 * kGapBits) | std::uint32_t{gap} << kGapBits | std::uint32_t{gap2};
    }
  };
  struct Record {
    static constexpr std::uint16_t kNone = 0xffff;
    bool here() const { return bits != kNone; }
    std::uint64_t word = 0;  // the record, or its place among the words
    std::uint16_t bits = kNone;
  };
  // Where the records of a key are, until the next Begin.
  using Place = std::uint32_t;
  static constexpr Place kNowhere = 0xffffffff;

  // For slots below `slots`.
  void Begin(std::size_t slots);
  void Prefetch(const Key& key) const {
    const Row& row = rows_[key.slot];
    if (row.begun == begun_) __builtin_prefetch(&blocks_[row.first]);
  }
  void Prefetch(Place place) const { __builtin_prefetch(&pairs_[place]); }
  Place Find(const Key& key) const {
    const Row& row = rows_[key.slot];
    if (row.begun != begun_) return kNowhere;
    const std::uint32_t packed = key.packed();
    for (std::uint32_t at = row.first; at != kNowhere; at = blocks_[at].next) {
      const Block& block = blocks_[at];
      for (std::uint32_t i = 0; i < block.count; ++i) {
        if (block.keys[i] == packed) return kInBlock * at + i;
      }
    }
    return kNowhere;
  }
  // Requires that the key is nowhere.
  Place Add(const Key& key);

  Record pose(Place place) const { return At(place, 0); }
  Record velocities(Place place) const { return At(place, 1); }
  void set_pose(Place place, const Record& record) { Set(place, 0, record); }
  void set_velocities(Place place, const Record& record) { Set(place, 1, record); }

  Record Store(const PackedRecord& record);
  PackedView View(const Record& record) const {
    return {record.bits <= 64 ? &record.word : words_.data() + record.word, record.bits};
  }

 private:
  static constexpr std::uint32_t kInBlock = 14;
  struct alignas(64) Block {
    std::array<std::uint32_t, kInBlock> keys{};
    std::uint32_t next = kNowhere;
    std::uint32_t count = 0;
  };
  static_assert(sizeof(Block) == 64);
  struct Pair {  // pose, velocities
    std::array<std::uint64_t, 2> words;
    std::array<std::uint16_t, 2> bits;
  };
  struct Row {
    std::uint32_t begun = 0;  // number of the Begin that it belongs to; after another it counts as empty
    Place first = kNowhere;   // block
  };

  Record At(Place place, std::size_t part) const { return {pairs_[place].words[part], pairs_[place].bits[part]}; }
  void Set(Place place, std::size_t part, const Record& record) {
    pairs_[place].words[part] = record.word;
    pairs_[place].bits[part] = record.bits;
  }

  std::vector<Row> rows_;  // by slot
  std::vector<Block> blocks_;
  std::vector<Pair> pairs_;  // by place: kInBlock of them for each block
  std::vector<std::uint64_t> words_;
  std::uint32_t begun_ = 0;
};

}  // namespace tessera::replication
