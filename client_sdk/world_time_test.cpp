#include "client_sdk/world_time.h"

#include <gtest/gtest.h>

#include <limits>

#include "client_sdk/testing/test_now.h"

namespace tessera::client {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t kRate = 60, kSnapshots = 30;

replication::ClockNews At(std::uint64_t tick, double pace, bool paused = false) {
  replication::ClockNews news;
  news.tick = tick;
  news.ticks_per_second = pace;
  news.paused = paused;
  return news;
}

TEST(WorldTimeTest, AReportFromBeforeAnotherOneChangesNothing) {
  WorldTime time(kRate, kSnapshots);
  EXPECT_EQ(time.Take(kTestNow, At(100, 30)), WorldTime::News::kChanged);
  EXPECT_EQ(time.Take(kTestNow, At(100, 30)), WorldTime::News::kOld);  // another region says the same
  EXPECT_EQ(time.Take(kTestNow, At(90, 60)), WorldTime::News::kOld);
  EXPECT_EQ(time.clock().ticks_per_second, 30);
  EXPECT_EQ(time.Take(kTestNow, At(110, 30, true)), WorldTime::News::kChanged);
  EXPECT_TRUE(time.clock().paused);
}

TEST(WorldTimeTest, RefusesAPaceThatNoWorldHas) {
  WorldTime time(kRate, kSnapshots);
  for (const double pace : {0.0, -1.0, kRate + 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(time.Take(kTestNow, At(1, pace)), WorldTime::News::kMalformed) << pace;
  }
}

TEST(WorldTimeTest, TheWorldGoesBackOnlyAfterASilence) {
  WorldTime time(kRate, kSnapshots);
  time.Arrived(kTestNow, Tick(1000));
  EXPECT_FALSE(time.GoesBack(Tick(10)));  // a late one
  time.AfterSilence();
  EXPECT_FALSE(time.GoesBack(Tick(1000 - kRate)));  // the first one decides
  EXPECT_FALSE(time.GoesBack(Tick(10)));
  time.AfterSilence();
  EXPECT_TRUE(time.GoesBack(Tick(1000 - kRate - 1)));
}

TEST(WorldTimeTest, StartsOverAtThePaceThatIsKnown) {
  WorldTime time(kRate, kSnapshots);
  ASSERT_EQ(time.Take(kTestNow, At(1000, 30)), WorldTime::News::kChanged);
  time.Arrived(kTestNow, Tick(1000));
  EXPECT_GT(time.Advance(kTestNow), 0);
  time.AfterSilence();  // from now on reports of earlier ticks count
  time.StartOver(kTestNow);
  EXPECT_EQ(time.newest(), Tick());
  EXPECT_EQ(time.shown_tick(), 0);
  EXPECT_EQ(time.clock().ticks_per_second, 30);
  EXPECT_NEAR(time.playout().tick_rate_hz(), 30, 1e-9);
  EXPECT_EQ(time.Take(kTestNow, At(10, 60)), WorldTime::News::kChanged);
}

}  // namespace
}  // namespace tessera::client
