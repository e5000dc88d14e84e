// A player who aims at a target on the screen hits it, whatever the delay, and whichever region has the target.
#include <gtest/gtest.h>

#include "bench/lag_shots.h"

namespace tessera::simulation {
namespace {

TEST(LagHitTest, ShotsHitWhatTheShooterWasShown) {
  const bench::LagShots shots = bench::ShootWithLag({.shots = 300});
  EXPECT_GE(shots.near, 297) << shots.missed << " missed, the worst hit is off by " << shots.worst_m;
  EXPECT_EQ(shots.incomplete, 0);
  EXPECT_GT(shots.across, 100);
  EXPECT_LT(shots.across, 200);
}

TEST(LagHitTest, WithoutRewindingMostMiss) {
  const bench::LagShots shots = bench::ShootWithLag({.shots = 100, .rewind = false});
  EXPECT_LT(shots.near, 20);
  EXPECT_EQ(shots.incomplete, 0);
}

TEST(LagHitTest, ALongerDelayThanMayBeLookedBackMisses) {
  const bench::LagShots shots = bench::ShootWithLag({.shots = 60, .round_trip_s = 0.6});
  EXPECT_LT(shots.near, 12);
}

}  // namespace
}  // namespace tessera::simulation
