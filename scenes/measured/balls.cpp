#include "scenes/measured/balls.h"

#include <numbers>

#include "scenes/measured/builder.h"

namespace tessera::scenes {

Scene Bounce() {
  Builder make("bounce");
  make.Ground({.friction = 0});
  const ShapePtr ball = BallOf(0.1);
  for (int i = 0; i < 49; ++i) {
    make.Dynamic(ball, {i % 7 - 3.0, 5, i / 7 - 3.0}, 10, {.friction = 0, .restitution = 1});
  }
  return make.Take();
}

// Friction is .4 between box and ground and .8 between box and ball, by geometric means.
Rolling RollingBalls(bool oblique) {
  constexpr double kForce = 150, kBoxMass = 10, kBallMass = 1, kGravity = 9.81, kFriction = 0.4;
  constexpr int kSide = 5;
  Builder make("rolling");
  make.Ground({.friction = 0.2});
  Rolling result;
  result.box = make.Dynamic(BoxOf(10, 0.5, 10), {0, 0.5, 0}, kBoxMass, {.friction = 0.8}).id;
  const ShapePtr ball = BallOf(0.5);
  for (int i = 0; i < kSide * kSide; ++i) {
    const Vec3d place{(i % kSide - 2) * 2.0, 1.5, (i / kSide - 2) * 2.0};
    result.last_ball = make.Dynamic(ball, place, kBallMass, {.friction = 0.8}).id;
  }
  result.first_ball = BodyId(result.box.value() + 1);
  result.direction = oblique ? Normalized(Vec3d{0.5, 0, 0.866}) : Vec3d{0, 0, 1};
  result.force_n = Vec3f(result.direction * kForce);
  // A solid ball that a plate takes along without slipping gains 2/7 of the plate's acceleration.
  const double balls = kSide * kSide * kBallMass;
  result.box_acceleration_m_s2 = (kForce - kFriction * kGravity * (kBoxMass + balls)) / (kBoxMass + balls * 2 / 7);
  result.ball_acceleration_m_s2 = result.box_acceleration_m_s2 * 2 / 7;
  result.scene = make.Take();
  return result;
}

Scene BallPile(bool elastic, std::uint64_t seed) {
  constexpr int kSide = 6;
  constexpr double kGap = 0.21, kJitter = 0.001;
  Builder make(elastic ? "elastic 666" : "666");
  Random random(seed);
  make.Ground({.friction = 0});
  const ShapePtr ball = BallOf(kPileRadius_m);
  for (int i = 0; i < kPileBalls; ++i) {
    const auto jittered = [&](int cell) { return cell * kGap + random.Between(-kJitter, kJitter); };
    const double x = jittered(i % kSide), z = jittered(i / kSide % kSide);
    const double y = (elastic ? 1.101 : 0.101) + i / (kSide * kSide) * kGap;
    make.Dynamic(ball, {x, y, z}, 10, {.friction = 0, .restitution = elastic ? 1.0 : 0.0});
  }
  return make.Take();
}

Cradle NewtonsCradle(int balls) {
  constexpr double kArm = 4, kRadius = 0.5, kPivot = 5;
  Builder make("newton's cradle");
  Cradle result;
  const ShapePtr ball = BallOf(kRadius);
  for (int i = 0; i < balls; ++i) {
    const Vec3d pivot{2 * kRadius * i, kPivot, 0};
    const Quatd lifted = i == 0 ? Turn({0, 0, 1}, -std::numbers::pi / 6) : Quatd();
    BodyDef& body =
        make.Dynamic(ball, pivot + Rotate(lifted, Vec3d{0, -kArm, 0}), 1, {.friction = 0, .restitution = 1});
    body.initial.orientation = lifted;
    result.last_ball = body.id;
    make.Joint(body.id, BodyId(), Pose{{0, kArm, 0}, {}}, Pose{pivot, {}}, HingeJoint{});
  }
  result.first_ball = BodyId(1);
  result.scene = make.Take();
  return result;
}

}  // namespace tessera::scenes
