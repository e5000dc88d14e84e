#include "scenes/measured/impacts.h"

#include <cmath>
#include <numbers>

#include "scenes/measured/builder.h"

namespace tessera::scenes {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kBulletRadius = 0.25, kBulletMass = 1e4 * 4 / 3 * kPi * kBulletRadius * kBulletRadius * kBulletRadius;
constexpr double kAway = 5;  // m between a bullet's start and what it flies at, besides the offset

double StartOf(double speed_m_s, double offset) { return kAway + offset * speed_m_s / 60; }

BodyDef& AddBullet(Builder& make, Vec3d from, double speed_m_s, double restitution) {
  BodyDef& bullet =
      make.Dynamic(BallOf(kBulletRadius), from, kBulletMass, {.friction = 0.5, .restitution = restitution});
  bullet.initial.linear_velocity = {static_cast<float>(speed_m_s), 0, 0};
  return bullet;
}

}  // namespace

Shot ShotAtWall(double speed_m_s, double wall_half_thickness_m, double offset, double restitution) {
  Shot shot{.scene = {}, .bullet = {}, .wall_face_m = -wall_half_thickness_m};
  Builder make("shot at a wall");
  make.Gravity(0);
  make.Static(BoxOf(wall_half_thickness_m, 10, 10), {});
  const double start = shot.wall_face_m - kBulletRadius - StartOf(speed_m_s, offset);
  shot.bullet = AddBullet(make, {start, 0.3, 0.2}, speed_m_s, restitution).id;
  shot.scene = make.Take();
  return shot;
}

Shot ShotAtGuardedBoxes(double offset) {
  constexpr double kSpeed = 500;
  Shot shot{.scene = {}, .bullet = {}, .wall_face_m = -0.1};
  Builder make("shot at guarded boxes");
  make.Ground();
  make.Static(BoxOf(0.1, 10, 10), {});
  shot.bullet = AddBullet(make, {shot.wall_face_m - kBulletRadius - StartOf(kSpeed, offset), 2, 0}, kSpeed, 0).id;
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5);
  for (int i = 0; i < 10; ++i) make.Dynamic(cube, {0.75 + i % 2 * 1.1, 0.5 + i / 2, 0}, 1);
  shot.scene = make.Take();
  return shot;
}

Shot SpinningRodAtWall(double speed_m_s, double offset) {
  constexpr double kRadius = 0.02, kHalf = 0.5, kSpin = 30;
  Shot shot{.scene = {}, .bullet = {}, .wall_face_m = -0.005};
  Builder make("spinning rod at a wall");
  make.Gravity(0);
  make.Static(BoxOf(0.005, 10, 10), {});
  const double start = shot.wall_face_m - kHalf - kRadius - StartOf(speed_m_s, offset);
  BodyDef& rod = make.Dynamic(CapsuleOf(kRadius, kHalf), {start, 0.3, 0.2}, 1);
  rod.initial.linear_velocity = {static_cast<float>(speed_m_s), 0, 0};
  rod.initial.angular_velocity = {0, 0, kSpin};
  shot.bullet = rod.id;
  shot.scene = make.Take();
  return shot;
}

Shot HeadOn(double speed_m_s, double offset) {
  Shot shot{.scene = {}, .bullet = {}, .wall_face_m = 0};
  Builder make("head on");
  make.Gravity(0);
  const double start = StartOf(speed_m_s, offset) + kBulletRadius;
  shot.bullet = AddBullet(make, {-start, 0, 0}, speed_m_s, 1).id;
  AddBullet(make, {kAway + kBulletRadius, 0, 0}, -speed_m_s, 1);
  shot.scene = make.Take();
  return shot;
}

Shot DrivenAtWall(double speed_m_s, double driver, double offset) {
  constexpr double kGap = 0.001;
  Shot shot{.scene = {}, .bullet = {}, .wall_face_m = -0.1};
  Builder make("driven at a wall");
  make.Gravity(0);
  make.Static(BoxOf(0.1, 10, 10), {}, {.friction = 0, .restitution = 1});
  const double start = shot.wall_face_m - kBulletRadius - StartOf(speed_m_s, offset);
  shot.bullet = AddBullet(make, {start, 0.3, 0.2}, speed_m_s, 0).id;
  AddBullet(make, {start - 2 * kBulletRadius - kGap, 0.3, 0.2}, speed_m_s, 0).mass_kg *= driver;
  shot.scene = make.Take();
  return shot;
}

Shot NearMiss(double speed_m_s, double offset) {
  Shot shot{.scene = {}, .bullet = {}, .wall_face_m = -0.1};
  Builder make("near miss");
  make.Gravity(0);
  make.Static(BoxOf(0.1, 5, 5), {0, -5, 0});
  const double start = shot.wall_face_m - StartOf(speed_m_s, offset);
  shot.bullet = AddBullet(make, {start, kBulletRadius + 0.01, 0}, speed_m_s, 0).id;
  shot.scene = make.Take();
  return shot;
}

Shot ThroughTrigger(double speed_m_s, double offset) {
  Shot shot{.scene = {}, .bullet = {}, .wall_face_m = -0.05};
  Builder make("through a trigger");
  make.Gravity(0);
  make.Static(BoxOf(0.05, 5, 5), {}).trigger = true;
  const double start = shot.wall_face_m - kBulletRadius - StartOf(speed_m_s, offset);
  shot.bullet = AddBullet(make, {start, 0, 0}, speed_m_s, 0).id;
  shot.scene = make.Take();
  return shot;
}

Scene SlopeAtLimit(double share) {
  constexpr double kFriction = 0.5;
  const double angle = share * std::atan(kFriction);
  Builder make("slope");
  const Quatd tilt = Turn({0, 0, 1}, -angle);
  const Vec3d normal = Rotate(tilt, Vec3d{0, 1, 0});
  make.Static(PlaneOf(normal), {}, {.friction = kFriction});
  make.Dynamic(BoxOf(0.5, 0.5, 0.5), normal * 0.5, 1, {.friction = kFriction}).initial.orientation = tilt;
  return make.Take();
}

Scene SlidingToRolling() {
  Builder make("sliding to rolling");
  make.Ground();
  make.Dynamic(BallOf(0.5), {0, 0.5, 0}, 1).initial.linear_velocity = {7, 0, 0};
  return make.Take();
}

RodDrop ObliqueRod(double restitution) {
  RodDrop drop{.scene = {},
               .rod = {},
               .half_length_m = 0.5,
               .radius_m = 0.05,
               .tilt_rad = kPi / 6,
               .speed_m_s = 3,
               .mass_kg = 1};
  Builder make("oblique rod");
  make.Gravity(0);
  make.Ground({.friction = 0});
  const Quatd tilt = Turn({0, 0, 1}, kPi / 2 + drop.tilt_rad);  // lying along x, then tilted
  const double low = drop.half_length_m * SinCosOf(drop.tilt_rad).sin + drop.radius_m;
  BodyDef& rod = make.Dynamic(CapsuleOf(drop.radius_m, drop.half_length_m), {0, low + 0.2, 0}, drop.mass_kg,
                              {.friction = 0, .restitution = restitution});
  rod.inertia_kg_m2 = Vec3d{0.1, 0.01, 0.1};
  rod.initial.orientation = tilt;
  rod.initial.linear_velocity = {0, static_cast<float>(-drop.speed_m_s), 0};
  drop.rod = rod.id;
  drop.scene = make.Take();
  return drop;
}

Scene BallOverFlatMesh() {
  constexpr double kRadius = 0.3, kSpeed = 8, kAside = 0.5;
  Builder make("ball over a flat mesh");
  make.Static(GridMeshOf(80, 1, [](double, double) { return 0.0; }), {});
  BodyDef& ball = make.Dynamic(BallOf(kRadius), {-30, kRadius, 0.37}, 1);
  TurnAbout(ball, ball.initial.position - Vec3d{0, kRadius, 0}, {kAside / kRadius, 0, -kSpeed / kRadius});
  return make.Take();
}

Scene Overlapping(double share) {
  Builder make("overlapping");
  make.Ground();
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5);
  make.Dynamic(cube, {0, 0.5, 0}, 1);
  make.Dynamic(cube, {0, 1.5 - share, 0}, 1);
  return make.Take();
}

Scene InertiaNeedle() {
  Builder make("needle");
  make.Ground();
  BodyDef& needle = make.Dynamic(BoxOf(0.5, 0.02, 0.02), {0, 2, 0}, 1);
  needle.inertia_kg_m2 = Vec3d{1e-4, 0.1, 0.1};
  needle.initial.orientation = Turn({0, 0, 1}, 0.4);
  needle.initial.angular_velocity = {20, 3, 1};
  return make.Take();
}

}  // namespace tessera::scenes
