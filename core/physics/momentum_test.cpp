// Momentum, linear and angular, of what only acts on each other.
#include <gmock/gmock.h>

#include <algorithm>

#include "core/physics/test_bodies.h"

namespace tessera::physics {
namespace {

struct Momentum {
  Vec3d linear, angular;                // about the world's origin
  double scale = 0, angular_scale = 0;  // sum of abs(p), and of abs(p) times its distance from the origin
};

Momentum MomentumOf(const World& world, std::span<const BodyDef> bodies) {
  Momentum sum;
  for (const BodyDef& body : bodies) {
    const BodyState state = world.StateOf(body.id);
    const Vec3d p = Vec3d(state.linear_velocity) * body.mass_kg;
    sum.linear += p;
    sum.angular += Cross(state.position, p) + AngularMomentum(world, body.id);
    sum.scale += Length(p);
    sum.angular_scale += Length(p) * Length(state.position);
  }
  return sum;
}

TEST(MomentumTest, IsKeptWhenTwoBodiesCollide) {
  World world({.gravity_m_s2 = {}});
  BodyDef a = Dynamic(1, Cube(), {-2, 0.3, 0.1}, 2), b = Dynamic(2, Ball(0.7), {2, 0, 0}, 5);
  a.initial.linear_velocity = {4, 0, 0};
  b.initial.linear_velocity = {-1, 0, 0.2f};
  a.material.restitution = 0.4;
  const std::vector<BodyDef> bodies = {a, b};
  AddAll(world, bodies);
  const Momentum before = MomentumOf(world, bodies);
  Simulate(world, 2);
  EXPECT_GT(world.StateOf(b.id).linear_velocity.x, 0);  // they met
  EXPECT_LT(Length(MomentumOf(world, bodies).linear - before.linear), 1e-5);
}

// About the world's origin, as bodies of several shapes fly into each other off centre, slide along each other and
// part.
TEST(MomentumTest, OfTurningIsKeptInCollisionsOffCentre) {
  const ShapePtr shapes[] = {Cube(0.5), Ball(0.5), MakeShapePtr(CapsuleShape{0.4, 0.3}),
                             MakeShapePtr(CylinderShape{0.4, 0.5})};
  for (const ShapePtr& shape_a : shapes) {
    for (const ShapePtr& shape_b : shapes) {
      for (const double restitution : {0.0, 0.7}) {
        World world({.gravity_m_s2 = {}, .sleep = false});
        BodyDef a = Dynamic(1, shape_a, {-2, 1, 0}, 1);
        BodyDef b = Dynamic(2, shape_b, {2, 1.3, 0.4}, 3);
        a.initial.linear_velocity = {0.8f, 0.1f, 0};
        b.initial.linear_velocity = {-0.5f, 0, 0.1f};
        for (BodyDef* body : {&a, &b}) {
          body->inertia_kg_m2 = Vec3d{0.2, 0.2, 0.2} * body->mass_kg;
          body->material = {.friction = 0.5, .restitution = restitution};
        }
        const std::vector<BodyDef> bodies = {a, b};
        AddAll(world, bodies);
        const Momentum before = MomentumOf(world, bodies);
        Simulate(world, 4);
        EXPECT_GT(Length(world.StateOf(a.id).angular_velocity), 0.05f);  // they met
        EXPECT_LT(Length(MomentumOf(world, bodies).angular - before.angular), 1e-5 * before.scale)
            << &shape_a - shapes << " against " << &shape_b - shapes << ", e = " << restitution;
      }
    }
  }
}

// Of a ship and its crew: what it is given is far less than its velocity is told by.
TEST(MomentumTest, IsKeptWhereOneIsFarHeavierThanTheRest) {
  World world({.gravity_m_s2 = {}, .sleep = false});
  std::vector<BodyDef> bodies = {Dynamic(1, Box(8, 1, 8), {0, -1, 0}, 2e6)};
  bodies[0].initial.linear_velocity = {3, 4, 0};
  for (std::uint64_t i = 0; i < 16; ++i) {
    const double x = -6 + 4 * static_cast<double>(i % 4), z = -6 + 4 * static_cast<double>(i / 4);
    bodies.push_back(Dynamic(2 + i, Cube(), {x, 0.6, z}));
    bodies.back().initial.linear_velocity = {3.5f, 2, -0.5f};
  }
  AddAll(world, bodies);
  const Momentum before = MomentumOf(world, bodies);
  Simulate(world, 1);
  Vec3d lost;
  for (std::size_t i = 1; i < bodies.size(); ++i) {
    lost += Vec3d(bodies[i].initial.linear_velocity) - Vec3d(world.StateOf(bodies[i].id).linear_velocity);
  }
  EXPECT_GT(Length(lost), 10);
  EXPECT_LT(Length(MomentumOf(world, bodies).linear - before.linear), 1e-7 * before.scale);
}

}  // namespace
}  // namespace tessera::physics
