// RecordCache: the records packed since the last push, to be shared by all clients that have acknowledged the same
// ticks.
//
//   cache.Begin();                                    // forgets all
//   cache.Prefetch(key);                              // some time before:
//   RecordCache::Entry& entry = cache.Find(key);      // valid until the next Find
//   if (!entry.pose().here()) entry.set_pose(cache.Store(packed));
//   RecordCache::Record pose = entry.pose();
//   PackedView bits = cache.View(pose);               // valid while `pose` is, and until the next Store
//
// A thousand clients look up tens of thousands of records a snapshot, each at random, so the cost is the memory that a
// look-up touches: an entry is half a cache line, and most records lie in it because they fit a word.
// Thread rule: one thread at a time.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "core/replication/codec/fast_record.h"

namespace tessera::replication {

class RecordCache {
 public:
  // A slot's present state against its states at three ticks. Fits 64 bits.
  struct Key {
    static constexpr int kSlotBits = 24, kTickBits = 28, kGapBits = 6;
    static_assert(kSlotBits + kTickBits + 2 * kGapBits == 64);
    std::uint32_t slot = 0;
    std::uint32_t ticks = 0;         // back to the base; 0: a full record
    std::uint8_t gap = 0, gap2 = 0;  // 0: there is none
    std::uint64_t packed() const {
      return std::uint64_t{slot} << (kTickBits + 2 * kGapBits) | std::uint64_t{ticks} << (2 * kGapBits) |
             std::uint64_t{gap} << kGapBits | gap2;
    }
  };
  struct Record {
    static constexpr std::uint16_t kNone = 0xffff;
    bool here() const { return bits != kNone; }
    std::uint64_t word = 0;  // the record, or its place among the words
    std::uint16_t bits = kNone;
  };
  struct alignas(32) Entry {
    std::uint64_t key = 0;
    std::uint64_t pose_word = 0, velocity_word = 0;
    std::uint32_t begun = 0;  // number of the Begin that it belongs to; after another it counts as empty
    std::uint16_t pose_bits = Record::kNone, velocity_bits = Record::kNone;

    Record pose() const { return {pose_word, pose_bits}; }
    Record velocities() const { return {velocity_word, velocity_bits}; }
    void set_pose(const Record& record) {
      pose_word = record.word;
      pose_bits = record.bits;
    }
    void set_velocities(const Record& record) {
      velocity_word = record.word;
      velocity_bits = record.bits;
    }
  };
  static_assert(sizeof(Entry) == 32);

  void Begin();
  void Prefetch(const Key& key) const {
    if (!table_.empty()) __builtin_prefetch(&table_[Hash(key.packed()) & (table_.size() - 1)], 1);
  }
  Entry& Find(const Key& key);
  // Whether there is an entry; may say no where it is not in its first place.
  bool Has(const Key& key) const {
    const std::uint64_t packed = key.packed();
    const Entry& entry = table_[Hash(packed) & (table_.size() - 1)];
    return entry.begun == begun_ && entry.key == packed;
  }

  Record Store(const PackedRecord& record);
  PackedView View(const Record& record) const {
    return {record.bits <= 64 ? &record.word : words_.data() + record.word, record.bits};
  }

 private:
  static std::uint64_t Hash(std::uint64_t key) {
    std::uint64_t hash = key * 0x9e3779b97f4a7c15;
    hash = (hash ^ (hash >> 32)) * 0x94d049bb133111eb;
    return hash ^ (hash >> 29);
  }
  Entry& Place(std::uint64_t key);
  void Grow();

  std::vector<Entry> table_;  // a power of two of them
  std::vector<std::uint64_t> words_;
  std::uint32_t begun_ = 0;
  std::size_t count_ = 0;
};

}  // namespace tessera::replication
