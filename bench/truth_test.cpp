// Truth is true: each against what is known of it independently.
#include "bench/truth.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tessera::bench {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr Vec3d kInertia{1, 2, 3};

TEST(SpinTest, KeepsEnergyAndMomentum) {
  const Spin start{{}, {0.01, 10, 0.01}};
  const Spin end = SpinAfter(kInertia, start, 20, 1e-4);
  EXPECT_NEAR(SpinEnergy(kInertia, end.orientation, end.angular_velocity), 100.00020, 1e-5);
  const Vec3d change = AngularMomentum(kInertia, end.orientation, end.angular_velocity) -
                       AngularMomentum(kInertia, start.orientation, start.angular_velocity);
  EXPECT_LT(Length(change), 1e-7);
}

TEST(SpinTest, ConvergesToOneAttitude) {
  const Spin start{{}, {0.01, 10, 0.01}};
  const Spin coarse = SpinAfter(kInertia, start, 20, 4e-4), fine = SpinAfter(kInertia, start, 20, 2e-4);
  EXPECT_LT(AngleBetween(coarse.orientation, fine.orientation), 1e-5);
}

// A round body turns at a constant rate about a fixed axis.
TEST(SpinTest, TurnsARoundBodyByRateTimesTime) {
  const Spin end = SpinAfter({2, 2, 2}, {{}, {0, 0, 1.5}}, 1, 1e-3);
  EXPECT_NEAR(AngleBetween(end.orientation, {}), 1.5, 1e-12);
}

// Poinsot: a symmetric top's axis goes round the angular momentum at |L| / I_across.
TEST(SpinTest, PrecessesASymmetricTopAtItsClosedFormRate) {
  const Vec3d inertia{1, 2, 1};
  const Spin start{{}, {0.5, 3, 0}};
  const Vec3d momentum = AngularMomentum(inertia, start.orientation, start.angular_velocity);
  const double once_round = 2 * kPi / Length(momentum);
  const Spin end = SpinAfter(inertia, start, once_round, 1e-4);
  EXPECT_LT(Length(Rotate(end.orientation, Vec3d{0, 1, 0}) - Vec3d{0, 1, 0}), 1e-9);
}

TEST(PendulumTest, PeriodAgreesWithItsSeriesAndItsKnownValueAtARightAngle) {
  const double a = 0.1, small = 2 * kPi * std::sqrt(2 / 9.81);
  EXPECT_NEAR(PendulumPeriod(2, 9.81, a), small * (1 + a * a / 16 + 11 * a * a * a * a / 3072), 1e-7);
  EXPECT_NEAR(PendulumPeriod(2, 9.81, kPi / 2) / small, 1.1803405990, 1e-9);  // K(1/sqrt 2) * 2 / pi
}

TEST(RodChainTest, OneRodIsAPhysicalPendulum) {
  // A rod of 1 m about its end: I = m l^2 / 3, so the length of the pendulum is 2/3.
  const std::vector<double> times = CrossingTimes(RodChain({{1, 1, 0.5, 1.0 / 12}}, 9.81), 3, 1e-3);
  const double period = PendulumPeriod(2.0 / 3, 9.81, kPi / 2);
  ASSERT_GE(times.size(), 2u);
  EXPECT_NEAR(times[0], period / 4, 1e-5);
  EXPECT_NEAR(times[1], period * 3 / 4, 1e-5);
}

TEST(RodChainTest, ManyRodsKeepTheirEnergy) {
  std::vector<Rod> rods(32, {1, 1, 0.5, 0.1});
  rods.push_back({1000, 2, 1, 400});
  RodChain chain(rods, 9.81);
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    chain.Step(1e-3);
    worst = std::max(worst, std::abs(chain.energy()));
  }
  EXPECT_LT(worst, 1e-3);  // against 33 * 9.81 * 1000 J that it may turn over
}

}  // namespace
}  // namespace tessera::bench
