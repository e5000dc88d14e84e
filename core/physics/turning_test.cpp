// Bodies that are not round and turn fast while contacts push them: what they are given acts on an inertia that turns.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "core/physics/testing/bodies.h"
#include "scenes/measured/flight.h"

namespace tessera::physics {
namespace {

// Relative error of the rate at which the spinning top goes round, from half a second on, for five seconds.
double PrecessionError(double dt_s, int substeps) {
  const scenes::SpinningTop top = scenes::MakeSpinningTop();
  World world({.gravity_m_s2 = top.scene.gravity_m_s2, .substeps = substeps, .sleep = false});
  AddAll(world, top.scene.bodies);
  const auto azimuth = [&] {  // counted as a turn about +y
    const Vec3d axis = Rotate(Quatd(world.StateOf(top.top).orientation), Vec3d{0, 1, 0});
    return std::atan2(-axis.z, axis.x);
  };
  Simulate(world, 0.5, dt_s);
  double before = azimuth(), turned_rad = 0;
  for (int look = 0; look < 50; ++look) {
    Simulate(world, 0.1, dt_s);
    const double now = azimuth();
    turned_rad += std::remainder(now - before, 2 * std::numbers::pi);
    before = now;
  }
  return std::abs(turned_rad / 5 / top.precession_rad_s - 1);
}

// It turns by 1.25 rad in a step, about a point that the ground pushes.
TEST(TurningTest, ATopGoesRoundAsItShouldInStepsOfAnySize) {
  EXPECT_LT(PrecessionError(1.0 / 60, 0), 1e-3);
  EXPECT_LT(PrecessionError(1.0 / 60, 1), 0.01);
}

// By 2.5 rad.
TEST(TurningTest, ATopGoesRoundAtThirtyStepsASecond) { EXPECT_LT(PrecessionError(1.0 / 30, 1), 0.03); }

}  // namespace
}  // namespace tessera::physics
