#include "core/physics/prediction.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "core/physics/testing/bodies.h"

namespace tessera::physics {
namespace {

BodyDef Thrown() {
  BodyDef body = Dynamic(2, Ball(), {1, 2, 3});
  body.initial.linear_velocity = {4, 8, -2};
  body.initial.angular_velocity = {0, 3, 0};
  return body;
}
const Forces kFalling{{0, -kGravity, 0}};

TEST(PredictionTest, IsAlgorithmOneWithoutDamping) {
  const BodyDef body = Thrown();
  const BodyState later = Predict(body, body.initial, kFalling, 0.5);
  EXPECT_NEAR(later.position.x, 1 + 4 * 0.5, 1e-12);
  EXPECT_NEAR(later.position.y, 2 + 8 * 0.5 - kGravity * 0.125, 1e-12);
  EXPECT_NEAR(later.linear_velocity.y, 8 - kGravity * 0.5, 1e-6);
  EXPECT_NEAR(2 * std::atan2(later.orientation.y, later.orientation.w), 1.5, 1e-6);
  EXPECT_EQ(later.angular_velocity, body.initial.angular_velocity);
}

TEST(PredictionTest, DampingTakesItsShareASecond) {
  BodyDef body = Thrown();
  body.linear_damping = 0.4;
  body.angular_damping = 0.9;
  const BodyState later = Predict(body, body.initial, {}, 2);
  EXPECT_NEAR(later.linear_velocity.x, 4 * 0.36, 1e-6);
  EXPECT_NEAR(later.angular_velocity.y, 3 * 0.01, 1e-6);
  // Distance and turn are the integrals of the velocities.
  const double k = -std::log(0.6), w = -std::log(0.1);
  EXPECT_NEAR(later.position.x, 1 + 4 * (1 - 0.36) / k, 1e-9);
  EXPECT_NEAR(2 * std::atan2(later.orientation.y, later.orientation.w), 3 * (1 - 0.01) / w, 1e-6);
}

TEST(PredictionTest, DampedFallMatchesSmallSteps) {
  for (const double damping : {0.0, 1e-9, 1e-5, 0.01, 0.5, 0.999}) {
    BodyDef body = Thrown();
    body.linear_damping = damping;
    const double k = -std::log1p(-damping);
    Vec3d p = body.initial.position, v(body.initial.linear_velocity);
    constexpr int kSteps = 200'000;
    const double h = 1.0 / kSteps;
    for (int i = 0; i < kSteps; ++i) {  // the midpoint rule
      const Vec3d middle = v + (kFalling.acceleration_m_s2 - v * k) * (h / 2);
      p += middle * h;
      v += (kFalling.acceleration_m_s2 - middle * k) * h;
    }
    const BodyState later = Predict(body, body.initial, kFalling, 1);
    EXPECT_LT(Length(later.position - p), 1e-8) << damping;
    EXPECT_LT(Length(Vec3d(later.linear_velocity) - v), 2e-6) << damping;
  }
}

TEST(PredictionTest, FullDampingStopsAtOnce) {
  BodyDef body = Thrown();
  body.linear_damping = body.angular_damping = 1;
  const BodyState later = Predict(body, body.initial, kFalling, 0.1);
  EXPECT_EQ(later.position, body.initial.position);
  EXPECT_EQ(later.linear_velocity, Vec3f());
  EXPECT_EQ(later.angular_velocity, Vec3f());
  EXPECT_EQ(later.orientation, body.initial.orientation);
}

TEST(PredictionTest, SleepersAndStaticsStay) {
  BodyDef body = Thrown();
  body.initial.asleep = true;
  EXPECT_EQ(Predict(body, body.initial, kFalling, 1), body.initial);
  const BodyDef wall = Static(3, Cube(), {1, 2, 3});
  EXPECT_EQ(Predict(wall, wall.initial, kFalling, 1), wall.initial);
  EXPECT_EQ(SweptBounds(wall, wall.initial, kFalling, 0.5, 1), (Aabb{{0.5, 1.5, 2.5}, {1.5, 2.5, 3.5}}));
}

TEST(PredictionTest, IsWhatTheWorldDoesInFreeFlight) {
  BodyDef body = Thrown();
  body.linear_damping = 0.1;
  body.angular_damping = 0.2;
  World world({});
  world.Add(body, body.initial);
  Simulate(world, 0.5);
  const BodyState stepped = world.StateOf(body.id), predicted = Predict(body, body.initial, kFalling, 0.5);
  // The world's integrator is of first order: it falls g t dt / 2 too far.
  EXPECT_LT(Length(stepped.position - predicted.position), kGravity * 0.5 * kDt / 2 + 0.04);
  EXPECT_LT(Length(stepped.linear_velocity - predicted.linear_velocity), 0.02);
  EXPECT_NEAR(stepped.orientation.y, predicted.orientation.y, 0.01);
}

TEST(SweptBoundsTest, HoldThePathAndTouchItOnEverySide) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int n = 0; n < 300; ++n) {
    BodyDef body = Thrown();
    body.linear_damping = n % 3 == 0 ? 0 : std::abs(unit(random));
    body.initial.linear_velocity = Vec3f(Vec3d{unit(random), unit(random), unit(random)} * 10.0);
    const Forces forces{Vec3d{unit(random), unit(random), unit(random)} * 20.0};
    const double radius = 0.3, dt = 1.5;
    const Aabb bounds = SweptBounds(body, body.initial, forces, radius, dt);
    Aabb path{body.initial.position, body.initial.position};
    for (int i = 0; i <= 2000; ++i) {
      const Vec3d p = Predict(body, body.initial, forces, dt * i / 2000).position;
      path = path.United({p, p});
    }
    const Aabb swept = path.Expanded(radius), larger = swept.Expanded(1e-4);
    EXPECT_TRUE(bounds.Expanded(1e-9).Contains(swept.min) && bounds.Expanded(1e-9).Contains(swept.max)) << n;
    EXPECT_TRUE(larger.Contains(bounds.min) && larger.Contains(bounds.max)) << n;
  }
}

}  // namespace
}  // namespace tessera::physics
