// Bodies that act on each other alone keep their linear and angular momentum.
#include <gmock/gmock.h>

#include <algorithm>
#include <map>

#include "core/physics/testing/bodies.h"
#include "scenes/measured/across.h"
#include "scenes/measured/balls.h"

namespace tessera::physics {
namespace {

struct Momentum {
  Vec3d linear, angular;                // about the world's origin
  double scale = 0, angular_scale = 0;  // sums of abs(p), and abs(p) times its distance from the origin
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

// Bodies of several shapes fly into each other off centre, slide along each other and part. Their angular momentum is
// that about the world's origin.
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

// A ship and its crew: the change of the ship's velocity is far below the resolution of that velocity.
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

// A contact that lives on from one step to the next starts with the friction that it had, and then bounces.
TEST(MomentumTest, OfTurningIsKeptWhereAContactThatWasThereBounces) {
  World world({.gravity_m_s2 = {}, .sleep = false});
  BodyDef a = Dynamic(1, MakeShapePtr(CapsuleShape{0.3, 0.3}), {-2.788, 1.7, 0.366}, 2.5);
  BodyDef b = Dynamic(2, MakeShapePtr(CapsuleShape{0.3, 0.3}), {-2.639, 2.85, 0.814}, 3.5);
  a.initial.linear_velocity = {-0.435f, 3.753f, 2.305f};
  a.initial.angular_velocity = {2.009f, 0, -1.156f};
  b.initial.linear_velocity = {0.311f, -2.681f, -1.646f};
  a.material = b.material = {.friction = 0.5, .restitution = 0.3};
  const std::vector<BodyDef> bodies = {a, b};
  AddAll(world, bodies);
  const Momentum before = MomentumOf(world, bodies);
  Simulate(world, 0.2);
  EXPECT_GT(world.StateOf(b.id).linear_velocity.y, 0);  // they bounced
  EXPECT_LT(Length(MomentumOf(world, bodies).angular - before.angular), 1e-6 * before.angular_scale);
}

// Bodies that bounce to and fro in a box that floats: fast ones are swept, and stopped where they meet something.
class FloatingBoxTest : public ::testing::Test {
 protected:
  FloatingBoxTest() : scene_(scenes::FloatingBox(60)), world_({.gravity_m_s2 = scene_.gravity_m_s2}) {
    AddAll(world_, scene_.bodies);
    for (const BodyDef& body : scene_.bodies) {
      if (body.mass_kg > box_.mass_kg) box_ = body;
    }
  }

  Scene scene_;
  World world_;
  BodyDef box_;
};

TEST_F(FloatingBoxTest, MomentumIsKept) {
  const Momentum before = MomentumOf(world_, scene_.bodies);
  Simulate(world_, 10);
  const Momentum after = MomentumOf(world_, scene_.bodies);
  EXPECT_LT(Length(after.linear - before.linear), 2e-6 * before.scale);
  EXPECT_LT(Length(after.angular - before.angular), 5e-6 * before.angular_scale);
}

TEST_F(FloatingBoxTest, TheBoxGoesOnWhateverBouncesInIt) {
  for (int step = 0; step < 600; ++step) {
    const Vec3d from = world_.StateOf(box_.id).position;
    world_.Step(kDt);
    const BodyState state = world_.StateOf(box_.id);
    ASSERT_LT(Length(state.position - from - Vec3d(state.linear_velocity) * kDt), 2e-3) << "step " << step;
  }
}

TEST_F(FloatingBoxTest, ContactsTellOfAllThatBodiesGained) {
  double pushed = 0;
  for (int step = 0; step < 300; ++step) {
    std::map<BodyId, Vec3d> linear, angular;
    for (const BodyDef& body : scene_.bodies) {
      linear[body.id] = Vec3d(world_.StateOf(body.id).linear_velocity) * body.mass_kg;
      angular[body.id] = Vec3d(world_.StateOf(body.id).angular_momentum);
    }
    world_.Step(kDt);
    for (const Contact& contact : world_.contacts()) {
      linear[contact.body_a] -= Vec3d(contact.impulse_on_b);
      linear[contact.body_b] += Vec3d(contact.impulse_on_b);
      angular[contact.body_a] += Vec3d(contact.angular_impulse_on_a);
      angular[contact.body_b] += Vec3d(contact.angular_impulse_on_b);
      pushed += Length(contact.impulse_on_b);
    }
    for (const BodyDef& body : scene_.bodies) {
      const BodyState state = world_.StateOf(body.id);
      const Vec3d p = Vec3d(state.linear_velocity) * body.mass_kg;
      ASSERT_LT(Length(p - linear[body.id]), 1e-6 * (body.mass_kg + Length(p))) << body.id << " step " << step;
      // A body that turns so fast that a blow would give it energy loses that again, which contacts do not report.
      ASSERT_LT(Length(Vec3d(state.angular_momentum) - angular[body.id]), 5e-3 * body.mass_kg)
          << body.id << " step " << step;
    }
  }
  EXPECT_GT(pushed, 100);
}

// A ball that is struck flies off faster than contacts were looked for, and takes along a light one that lies before a
// thin wall: both stay this side of it.
TEST(CarryTest, WhatIsTakenAlongDoesNotPassAWall) {
  for (const double gap : {0.2, 0.5, 0.9, 1.4}) {
    World world({.gravity_m_s2 = {}, .sleep = false});
    BodyDef wall = Static(1, Box(0.01, 3, 3), {2, 0, 0});
    BodyDef striker = Dynamic(2, Ball(), {-2.3, 0, 0}, 100), struck = Dynamic(3, Ball(0.3), {-0.4, 0, 0}, 10);
    BodyDef light = Dynamic(4, Ball(0.1), {2 - gap, 0.02, 0}, 1);
    striker.initial.linear_velocity = {100, 0, 0};
    for (BodyDef* body : {&striker, &struck, &light}) body->material.restitution = 0.9;
    AddAll(world, {wall, striker, struck, light});
    for (int step = 0; step < 6; ++step) {
      world.Step(kDt);
      ASSERT_LT(world.StateOf(light.id).position.x, 2) << "gap " << gap << " step " << step;
      ASSERT_LT(world.StateOf(struck.id).position.x, 2) << "gap " << gap << " step " << step;
    }
    EXPECT_LT(world.StateOf(struck.id).linear_velocity.x, 50);  // it was there
  }
}

// Elastic balls at five steps a second are knocked about within a step and stopped by each other all the time. The
// turning that they get back must not feed on itself: it grows with the square of their speed.
TEST(CarryTest, ElasticBallsInLongStepsAreNotBlownUp) {
  const Scene scene = scenes::BallPile(true);
  World world({.gravity_m_s2 = scene.gravity_m_s2, .sleep = false});
  AddAll(world, scene.bodies);
  const auto energy = [&](bool moving) {
    double sum_j = 0;
    for (const BodyDef& body : scene.bodies) {
      if (body.motion != Motion::kDynamic) continue;
      const BodyState state = world.StateOf(body.id);
      const double runs = body.mass_kg * static_cast<double>(LengthSquared(state.linear_velocity));
      const double spins = static_cast<double>(Dot(state.angular_velocity, state.angular_momentum));
      sum_j += moving ? (runs + spins) / 2 : body.mass_kg * kGravity * state.position.y;
    }
    return sum_j;
  };
  const double start_j = energy(false);
  for (int step = 0; step < 50; ++step) {
    world.Step(0.2);
    ASSERT_LT(energy(true), 300 * start_j) << "step " << step;
  }
}

}  // namespace
}  // namespace tessera::physics
