#include "region_worker/core/step_times.h"

#include <gtest/gtest.h>

namespace tessera::worker {
namespace {

using std::chrono::milliseconds;

TEST(StepTimesTest, IsZeroBeforeTheFirst) { EXPECT_EQ(StepTimes().Summary().max_s, 0); }

TEST(StepTimesTest, RanksAreNearest) {
  StepTimes times;
  for (int i = 100; i >= 1; --i) times.Add(milliseconds(i));
  const TimeSummary summary = times.Summary();
  EXPECT_FLOAT_EQ(static_cast<float>(summary.p50_s), 0.032F) << "of the newest 64";
  EXPECT_FLOAT_EQ(static_cast<float>(summary.p99_s), 0.099F);
  EXPECT_FLOAT_EQ(static_cast<float>(summary.max_s), 0.100F);
}

TEST(StepTimesTest, OldOnesAreForgotten) {
  StepTimes times;
  times.Add(milliseconds(500));
  for (std::size_t i = 0; i < StepTimes::kSamples; ++i) times.Add(milliseconds(1));
  EXPECT_FLOAT_EQ(static_cast<float>(times.Summary().max_s), 0.001F);
}

TEST(StepTimesTest, TheMedianFollowsWithinASecond) {
  StepTimes times;
  for (std::size_t i = 0; i < StepTimes::kSamples; ++i) times.Add(milliseconds(9));
  for (std::size_t i = 0; i < StepTimes::kRecent; ++i) times.Add(milliseconds(2));
  EXPECT_FLOAT_EQ(static_cast<float>(times.Summary().p50_s), 0.002F);
  EXPECT_FLOAT_EQ(static_cast<float>(times.Summary().max_s), 0.009F);
}

TEST(RateMeterTest, IsExactForAnEvenClock) {
  RateMeter meter;
  TimePoint now{};
  for (std::uint64_t tick = 1; tick <= 600; ++tick, now += milliseconds(20)) meter.Observe(now, Tick(tick));
  EXPECT_DOUBLE_EQ(meter.rate_hz(now), 50);
}

TEST(RateMeterTest, FollowsAChangeWithinItsWindow) {
  RateMeter meter;
  TimePoint now{};
  std::uint64_t tick = 0;
  for (int i = 0; i < 600; ++i, now += milliseconds(10)) meter.Observe(now, Tick(++tick));
  for (int i = 0; i < 60; ++i, now += milliseconds(40)) meter.Observe(now, Tick(++tick));
  EXPECT_NEAR(meter.rate_hz(now), 25, 1e-9);
}

TEST(RateMeterTest, FallsWhileNothingHappens) {
  RateMeter meter;
  TimePoint now{};
  for (std::uint64_t tick = 1; tick <= 300; ++tick, now += milliseconds(10)) meter.Observe(now, Tick(tick));
  EXPECT_NEAR(meter.rate_hz(now + std::chrono::seconds(98)), 2, 0.1);  // 200 ticks in 100 s
  EXPECT_EQ(RateMeter().rate_hz(now), 0);
}

}  // namespace
}  // namespace tessera::worker
