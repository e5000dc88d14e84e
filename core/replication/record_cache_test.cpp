#include "core/replication/record_cache.h"

#include <gtest/gtest.h>

namespace tessera::replication {
namespace {

PackedRecord RecordOf(std::uint64_t number, int bits) {
  PackedRecord record;
  for (; bits > 64; bits -= 64) record.Append(number++, 64);
  record.Append(bits == 64 ? number : number & ((std::uint64_t{1} << bits) - 1), bits);
  return record;
}

// Whole words and the bits of the last one.
std::vector<std::uint64_t> WordsOf(const PackedView& view) { return {view.words, view.words + (view.bits + 63) / 64}; }

RecordCache::Key KeyOf(std::uint32_t n) {
  return {.slot = n / 40, .ticks = 3 + n % 10, .gap = static_cast<std::uint8_t>(1 + n / 10 % 4), .gap2 = 0};
}

TEST(RecordCacheTest, KeepsShortAndLongRecordsWhileItGrows) {
  constexpr std::uint32_t kRecords = 3000, kSlots = 80;  // many more to a slot than a block holds
  RecordCache cache;
  cache.Begin(kSlots);
  for (std::uint32_t n = 0; n < kRecords; ++n) {
    ASSERT_EQ(cache.Find(KeyOf(n)), RecordCache::kNowhere) << n;
    const RecordCache::Place place = cache.Add(KeyOf(n));
    ASSERT_FALSE(cache.pose(place).here()) << n;
    cache.set_pose(place, cache.Store(RecordOf(n, n % 3 == 0 ? 200 : 40)));
  }
  for (std::uint32_t n = 0; n < kRecords; ++n) {
    const RecordCache::Place place = cache.Find(KeyOf(n));
    ASSERT_NE(place, RecordCache::kNowhere) << n;
    const RecordCache::Record pose = cache.pose(place);
    EXPECT_FALSE(cache.velocities(place).here()) << n;
    const PackedRecord expected = RecordOf(n, n % 3 == 0 ? 200 : 40);
    EXPECT_EQ(pose.bits, expected.bits);
    EXPECT_EQ(WordsOf(cache.View(pose)), WordsOf(expected.view())) << n;
  }
}

TEST(RecordCacheTest, ForgetsAllAtTheNextBegin) {
  RecordCache cache;
  cache.Begin(1);
  const RecordCache::Place place = cache.Add(KeyOf(1));
  cache.set_pose(place, cache.Store(RecordOf(5, 40)));
  cache.set_velocities(place, cache.Store(PackedRecord()));
  ASSERT_EQ(cache.Find(KeyOf(1)), place);
  EXPECT_TRUE(cache.velocities(place).here());
  cache.Begin(2);
  EXPECT_EQ(cache.Find(KeyOf(1)), RecordCache::kNowhere);
  EXPECT_EQ(cache.Find(KeyOf(41)), RecordCache::kNowhere) << "a slot that has come since";
  const RecordCache::Place again = cache.Add(KeyOf(1));
  EXPECT_FALSE(cache.pose(again).here());
  EXPECT_FALSE(cache.velocities(again).here());
}

TEST(RecordCacheTest, TellsKeysApartThatDifferInOnePart) {
  const RecordCache::Key keys[] = {{7, 9, 2, 3}, {8, 9, 2, 3},   {7, 10, 2, 3}, {7, 9, 3, 3},
                                   {7, 9, 2, 4}, {7, 9, 32, 32}, {7, 0, 0, 0}};
  RecordCache cache;
  cache.Begin(9);
  for (const RecordCache::Key& key : keys) {
    EXPECT_EQ(cache.Find(key), RecordCache::kNowhere);
    (void)cache.Add(key);
  }
}

}  // namespace
}  // namespace tessera::replication
