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
  return {.slot = n / 4, .ticks = 3 + n % 2, .gap = static_cast<std::uint8_t>(1 + n % 4), .gap2 = 0};
}

TEST(RecordCacheTest, KeepsShortAndLongRecordsWhileItGrows) {
  constexpr std::uint32_t kRecords = 3000;  // ten times the room that it begins with
  RecordCache cache;
  cache.Begin();
  for (std::uint32_t n = 0; n < kRecords; ++n) {
    RecordCache::Entry& entry = cache.Find(KeyOf(n));
    ASSERT_FALSE(entry.pose().here()) << n;
    entry.set_pose(cache.Store(RecordOf(n, n % 3 == 0 ? 200 : 40)));
  }
  for (std::uint32_t n = 0; n < kRecords; ++n) {
    const RecordCache::Record pose = cache.Find(KeyOf(n)).pose();
    ASSERT_TRUE(pose.here()) << n;
    const PackedRecord expected = RecordOf(n, n % 3 == 0 ? 200 : 40);
    EXPECT_EQ(pose.bits, expected.bits);
    EXPECT_EQ(WordsOf(cache.View(pose)), WordsOf(expected.view())) << n;
  }
}

TEST(RecordCacheTest, ForgetsAllAtTheNextBegin) {
  RecordCache cache;
  cache.Begin();
  RecordCache::Entry& entry = cache.Find(KeyOf(1));
  entry.set_pose(cache.Store(RecordOf(5, 40)));
  entry.set_velocities(cache.Store(PackedRecord()));
  EXPECT_TRUE(cache.Find(KeyOf(1)).velocities().here());
  EXPECT_TRUE(cache.Has(KeyOf(1)));
  cache.Begin();
  EXPECT_FALSE(cache.Has(KeyOf(1)));
  EXPECT_FALSE(cache.Find(KeyOf(1)).pose().here());
  EXPECT_FALSE(cache.Find(KeyOf(1)).velocities().here());
}

TEST(RecordCacheTest, TellsKeysApartThatDifferInOnePart) {
  const RecordCache::Key key{.slot = 7, .ticks = 9, .gap = 2, .gap2 = 3};
  const RecordCache::Key others[] = {{8, 9, 2, 3}, {7, 10, 2, 3}, {7, 9, 3, 3}, {7, 9, 2, 4}, {7, 9, 32, 32}};
  for (const RecordCache::Key& other : others) EXPECT_NE(key.packed(), other.packed());
}

}  // namespace
}  // namespace tessera::replication
