#include "core/physics/body_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/physics/trig.h"

namespace tessera::physics {
namespace {

Pose At(double x, double y = 0, double z = 0) { return {{x, y, z}, {}}; }

// There and back between two points: the smooth step 3 u^2 - 2 u^3.
TEST(BodyPathTest, GoesThereAndBackSmoothly) {
  const BodyPath path{{{0, At(0)}, {4, At(8)}}, PathRepeat::kPingPong, {}};
  for (double t = 0; t <= 4; t += 0.25) {
    const double u = t / 4, x = 8 * (3 * u * u - 2 * u * u * u);
    EXPECT_NEAR(PoseOn(path, t).position.x, x, 1e-12);
    EXPECT_NEAR(PoseOn(path, 8 - t).position.x, x, 1e-12);
    EXPECT_NEAR(PoseOn(path, 80 + t).position.x, x, 1e-9);
  }
}

TEST(BodyPathTest, StaysAtTheEndOfAWayThatItGoesOnce) {
  const BodyPath path{{{0, At(0)}, {2, At(3)}}, PathRepeat::kOnce, {}};
  EXPECT_EQ(PoseOn(path, 2).position, Vec3d(3, 0, 0));
  EXPECT_EQ(PoseOn(path, 1e6).position, Vec3d(3, 0, 0));
  EXPECT_TRUE(StateOn(path, Tick(120), 60).asleep);
  EXPECT_FALSE(StateOn(path, Tick(60), 60).asleep);
}

// Points in a row at equal times are passed at one speed.
TEST(BodyPathTest, PassesPointsWithoutAJerk) {
  const BodyPath path{{{0, At(0)}, {1, At(1)}, {2, At(2)}, {3, At(3)}, {4, At(4)}}, PathRepeat::kOnce, {}};
  for (double t = 1; t <= 3; t += 0.125) EXPECT_NEAR(PoseOn(path, t).position.x, t, 1e-12);
}

TEST(BodyPathTest, AVelocityIsContinuous) {
  const BodyPath path{
      {{0, At(0)}, {1, At(3, 1)}, {1.5, At(3, 4, 1)}, {4, At(0, 2)}, {5, At(0)}}, PathRepeat::kLoop, {}};
  const double h = 1e-5;
  for (const double t : {1.0, 1.5, 4.0, 5.0}) {
    const Vec3d before = (PoseOn(path, t).position - PoseOn(path, t - h).position) / h;
    const Vec3d after = (PoseOn(path, t + h).position - PoseOn(path, t).position) / h;
    EXPECT_LT(Length(after - before), 1e-3) << t;
  }
}

TEST(BodyPathTest, WaitsBetweenTwoPointsInOnePlace) {
  const BodyPath path{{{0, At(0)}, {1, At(2)}, {3, At(2)}, {4, At(0)}, {6, At(0)}}, PathRepeat::kLoop, {}};
  for (double t = 1; t <= 3; t += 0.25) EXPECT_EQ(PoseOn(path, t).position, Vec3d(2, 0, 0));
  EXPECT_EQ(PoseOn(path, 5).position, Vec3d());
  EXPECT_TRUE(StateOn(path, Tick(120), 60).asleep);
}

TEST(BodyPathTest, TurnsTheShortestWay) {
  const Quatd quarter = TurnBy({0, std::numbers::pi / 2, 0});
  const BodyPath door{{{0, {}}, {2, {{}, quarter}}}, PathRepeat::kPingPong, {}};
  EXPECT_NEAR(RotationVectorOf(PoseOn(door, 1).orientation).y, std::numbers::pi / 4, 1e-12);
  EXPECT_NEAR(RotationVectorOf(PoseOn(door, 2).orientation).y, std::numbers::pi / 2, 1e-12);
}

TEST(BodyPathTest, SpinsEvenly) {
  const BodyPath table{{{0, At(1)}}, PathRepeat::kLoop, {0, 0.5, 0}};
  EXPECT_NEAR(RotationVectorOf(PoseOn(table, 3).orientation).y, 1.5, 1e-12);
  const BodyState state = StateOn(table, Tick(1'000'000), 60);
  EXPECT_NEAR(static_cast<double>(state.angular_velocity.y), 0.5, 1e-5);
  EXPECT_EQ(state.position, Vec3d(1, 0, 0));
}

// The velocities of a state lead to the next one.
TEST(BodyPathTest, AStateLeadsToTheNext) {
  const BodyPath path{{{0, At(0)}, {1, {{3, 1, 0}, TurnBy({0.3, 0.2, 0})}}, {3, At(0)}}, PathRepeat::kLoop, {0, 1, 0}};
  for (std::uint64_t tick = 0; tick < 600; tick += 7) {
    const BodyState here = StateOn(path, Tick(tick), 60), next = StateOn(path, Tick(tick + 1), 60);
    EXPECT_LT(Length(here.position + Vec3d(here.linear_velocity) / 60.0 - next.position), 1e-7);
    const Quatd turned = TurnBy(Vec3d(here.angular_velocity) / 60.0) * here.orientation;
    EXPECT_LT(Length(RotationVectorOf(turned * Conjugate(next.orientation))), 1e-7);
  }
}

}  // namespace
}  // namespace tessera::physics
