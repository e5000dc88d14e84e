#include "client_sdk/playout_clock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>

namespace tessera::client {
namespace {

using std::chrono::duration_cast;
using std::chrono::nanoseconds;
constexpr double kTicksPerSecond = 60, kSnapshotsPerSecond = 30, kFramesPerSecond = 144;

// Runs a world whose snapshots arrive after a delay of their own, and frames that show it.
struct Showing {
  PlayoutClock clock{kTicksPerSecond, kSnapshotsPerSecond};
  std::chrono::steady_clock::time_point zero{std::chrono::hours(5)};
  double shown = 0, worst_lag_s = 0, least_lag_s = 1e9, worst_speed_error = 0;

  auto At(double seconds) const { return zero + duration_cast<nanoseconds>(std::chrono::duration<double>(seconds)); }

  // `rate(t)`: the world's ticks a second; `delay(n)`: of snapshot n in seconds. Measures from `settle_s` on.
  void Go(double seconds, double settle_s, const std::function<double(double)>& rate,
          const std::function<double(int)>& delay) {
    std::multimap<double, Tick> in_flight;
    double world_tick = 100, next_snapshot = world_tick, last_shown = 0;
    int number = 0;
    for (int frame = 0; frame < static_cast<int>(seconds * kFramesPerSecond); ++frame) {
      const double t = frame / kFramesPerSecond;
      for (; next_snapshot <= world_tick; next_snapshot += kTicksPerSecond / kSnapshotsPerSecond) {
        in_flight.emplace(t + delay(number++), Tick(static_cast<std::uint64_t>(next_snapshot)));
      }
      for (auto at = in_flight.begin(); at != in_flight.end() && at->first <= t; at = in_flight.erase(at)) {
        clock.Arrived(At(t), at->second);
      }
      shown = clock.Advance(At(t));
      ASSERT_GE(shown, last_shown) << "went back at " << t;
      if (t > settle_s) {
        const double lag_s = (world_tick - shown) / rate(t);
        worst_lag_s = std::max(worst_lag_s, lag_s);
        least_lag_s = std::min(least_lag_s, lag_s);
        const double speed = (shown - last_shown) * kFramesPerSecond / rate(t);
        worst_speed_error = std::max(worst_speed_error, std::abs(speed - 1));
      }
      last_shown = shown;
      world_tick += rate(t) / kFramesPerSecond;
    }
  }
};

TEST(PlayoutClockTest, RunsSteadilyTwoSnapshotsBehind) {
  Showing run;
  run.Go(
      10, 2, [](double) { return kTicksPerSecond; }, [](int) { return 0.02; });
  EXPECT_EQ(run.clock.jumps(), 0u);
  EXPECT_LT(run.worst_speed_error, 0.03);
  EXPECT_GT(run.least_lag_s, 0.07);  // 20 ms on the way, two intervals of 33 ms, half an interval's sawtooth either way
  EXPECT_LT(run.worst_lag_s, 0.16);
  EXPECT_NEAR(run.clock.tick_rate_hz(), kTicksPerSecond, 1);
}

TEST(PlayoutClockTest, JitterDeepensTheDelay) {
  Showing calm, rough;
  std::mt19937 random(1);
  calm.Go(
      10, 2, [](double) { return kTicksPerSecond; }, [](int) { return 0.02; });
  rough.Go(
      10, 2, [](double) { return kTicksPerSecond; },
      [&](int) { return std::uniform_real_distribution<double>(0, 0.08)(random); });
  EXPECT_GT(rough.clock.jitter_s(), 2 * calm.clock.jitter_s());
  EXPECT_GT(rough.clock.delay_s(), calm.clock.delay_s() + 0.02);
  EXPECT_LE(rough.worst_speed_error, 0.15);
  EXPECT_EQ(rough.clock.jumps(), 0u);
}

TEST(PlayoutClockTest, FollowsAWorldThatSlowsDown) {
  Showing run;
  run.Go(
      20, 11, [](double t) { return t < 5 ? kTicksPerSecond : kTicksPerSecond / 2; }, [](int) { return 0.02; });
  EXPECT_NEAR(run.clock.tick_rate_hz(), kTicksPerSecond / 2, 1.5);
  EXPECT_LT(run.worst_speed_error, 0.12);
  EXPECT_GT(run.least_lag_s, 0.02);
  EXPECT_LT(run.worst_lag_s, 0.35);
}

TEST(PlayoutClockTest, AWorldThatStandsIsNotRunAwayFrom) {
  Showing run;
  run.Go(
      6, 5, [](double t) { return t < 2 ? kTicksPerSecond : 1e-9; }, [](int) { return 0.02; });
  const double last_tick = 100 + 2 * kTicksPerSecond;
  EXPECT_LT(run.shown, last_tick + 0.6 * kTicksPerSecond);  // at most the silence that it bridges
}

TEST(PlayoutClockTest, AfterAGapItJumpsOnceAndGoesOn) {
  Showing run;
  run.Go(
      12, 8, [](double) { return kTicksPerSecond; },
      [](int n) { return n >= 90 && n < 150 ? 1e9 : 0.02; });  // 2 s lost
  EXPECT_LE(run.clock.jumps(), 2u);
  EXPECT_LT(run.worst_speed_error, 0.05);
  EXPECT_LT(run.worst_lag_s, 0.2);
}

TEST(PlayoutClockTest, BeforeAnythingCameThereIsNoMoment) {
  PlayoutClock clock(kTicksPerSecond, kSnapshotsPerSecond);
  EXPECT_FALSE(clock.started());
  EXPECT_EQ(clock.Advance(std::chrono::steady_clock::time_point()), 0);
}

TEST(PlayoutClockTest, APausedWorldIsShownAsItsNewestSnapshotHasItAndGoesOnFromThere) {
  PlayoutClock clock(60, 30);
  const std::chrono::steady_clock::time_point zero{std::chrono::hours(5)};
  const auto at = [&](int ms) { return zero + std::chrono::milliseconds(ms); };
  for (int i = 0; i < 60; ++i) {
    clock.Arrived(at(i * 33), Tick(static_cast<std::uint64_t>(100 + 2 * i)));
    (void)clock.Advance(at(i * 33));
  }
  clock.SetPace(at(2000), 60, true);
  for (int ms = 2000; ms < 4000; ms += 16) EXPECT_LE(clock.Advance(at(ms)), 218) << "nothing is extrapolated";
  EXPECT_EQ(clock.Advance(at(4000)), 218);
  clock.SetPace(at(60'000), 60, false);
  double last = 218;
  for (int i = 0; i < 90; ++i) {
    clock.Arrived(at(60'000 + i * 33), Tick(static_cast<std::uint64_t>(220 + 2 * i)));
    const double shown = clock.Advance(at(60'000 + i * 33));
    EXPECT_GE(shown, last);
    last = shown;
  }
  EXPECT_NEAR(last, 398 - 6, 4);
  EXPECT_EQ(clock.jumps(), 0u);
}

TEST(PlayoutClockTest, SlowMotionIsShownSteadily) {
  PlayoutClock clock(60, 30);
  const std::chrono::steady_clock::time_point zero{std::chrono::hours(5)};
  const auto at = [&](int ms) { return zero + std::chrono::milliseconds(ms); };
  clock.SetPace(zero, 2, false);
  double last = 0, fastest = 0;
  for (int ms = 0; ms < 30'000; ms += 10) {
    if (ms % 1000 == 0) clock.Arrived(at(ms), Tick(static_cast<std::uint64_t>(100 + 2 * ms / 1000)));
    const double shown = clock.Advance(at(ms));
    if (ms > 10'000) {
      EXPECT_GE(shown, last);
      fastest = std::max(fastest, shown - last);
    }
    last = shown;
  }
  EXPECT_LT(fastest, 0.02 * 1.2) << "2 ticks a second, at most a tenth faster";
  EXPECT_EQ(clock.jumps(), 0u);
}

}  // namespace
}  // namespace tessera::client
