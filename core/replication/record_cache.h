// RecordCache: what was packed for one client since the last push, for every other that has acknowledged the same
// ticks.
//
//   cache.Begin();                                    // forgets all
//   cache.Prefetch(key);                              // some time before:
//   RecordCache::Entry& entry = cache.Find(key);      // valid until the next Find
//   if (!entry.has_pose()) cache.SetPose(entry, packed);
//   PackedView bits = cache.Pose(entry);              // valid until something is set
//
// A thousand clients look up tens of thousands of records a snapshot, each at random, so what counts is how much memory
// one of them touches: an entry is half a cache line, its bits lie together with those of others.
// Thread rule: one thread at a time.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "core/replication/codec/fast_record.h"

namespace tessera::replication {

class RecordCache {
 public:
  // A slot's present state against its states at three ticks.
  struct Key {
    std::uint32_t slot = 0;
    std::uint32_t ticks = 0;         // back to the base; 0: whole
    std::uint8_t gap = 0, gap2 = 0;  // 0: there is none
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct alignas(32) Entry {
    bool has_pose() const { return pose_bits != kNone; }
    bool has_velocities() const { return velocity_bits != kNone; }

    static constexpr std::uint16_t kNone = 0xffff;
    Key key;
    std::uint32_t begun = 0;  // the Begin of which it is; of others it is empty
    std::uint32_t pose_at = 0, velocities_at = 0;
    std::uint16_t pose_bits = kNone, velocity_bits = kNone;
  };

  void Begin();
  void Prefetch(const Key& key) const {
    if (!table_.empty()) __builtin_prefetch(&table_[Hash(key) & (table_.size() - 1)]);
  }
  Entry& Find(const Key& key);

  void SetPose(Entry& entry, const PackedRecord& pose) {
    entry.pose_at = Store(pose);
    entry.pose_bits = static_cast<std::uint16_t>(pose.bits);
  }
  void SetVelocities(Entry& entry, const PackedRecord& velocities) {
    entry.velocities_at = Store(velocities);
    entry.velocity_bits = static_cast<std::uint16_t>(velocities.bits);
  }
  PackedView At(std::uint32_t at, std::uint16_t bits) const { return {words_.data() + at, bits}; }
  void PrefetchWords(std::uint32_t at) const { __builtin_prefetch(words_.data() + at); }

 private:
  static std::uint64_t Hash(const Key& key) {
    std::uint64_t hash = std::uint64_t{key.slot} << 32 | key.ticks;
    hash = (hash ^ (std::uint64_t{key.gap} << 24) ^ (std::uint64_t{key.gap2} << 16)) * 0x9e3779b97f4a7c15;
    hash = (hash ^ (hash >> 32)) * 0x94d049bb133111eb;
    return hash ^ (hash >> 29);
  }
  Entry& Place(const Key& key);
  void Grow();
  std::uint32_t Store(const PackedRecord& record);

  std::vector<Entry> table_;  // a power of two of them
  std::vector<std::uint64_t> words_;
  std::uint32_t begun_ = 0;
  std::size_t count_ = 0;
};

}  // namespace tessera::replication
