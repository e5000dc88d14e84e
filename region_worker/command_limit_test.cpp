#include "region_worker/command_limit.h"

#include <gtest/gtest.h>

namespace tessera::worker {
namespace {

constexpr TimePoint kBeginning{std::chrono::hours(1)};

int TakenOf(CommandLimit& limit, int count, std::size_t bytes, Duration between) {
  TimePoint now = kBeginning;
  int taken = 0;
  for (int i = 0; i < count; ++i, now += between) taken += limit.Take(now, bytes) ? 1 : 0;
  return taken;
}

TEST(CommandLimitTest, APersonIsNeverLimited) {
  CommandLimit limit;
  EXPECT_EQ(TakenOf(limit, 1000, 64, std::chrono::milliseconds(60)), 1000);
}

TEST(CommandLimitTest, AFloodIsCutToABurstAndTheRate) {
  CommandLimit limit;
  const int taken = TakenOf(limit, 100'000, 10, std::chrono::microseconds(100));  // ten seconds
  EXPECT_GE(taken, 239);
  EXPECT_LE(taken, 241);
}

TEST(CommandLimitTest, BytesCountToo) {
  CommandLimit limit;
  const int taken = TakenOf(limit, 1000, 1024, std::chrono::milliseconds(10));  // ten seconds
  EXPECT_GE(taken, 47);
  EXPECT_LE(taken, 49);
}

}  // namespace
}  // namespace tessera::worker
