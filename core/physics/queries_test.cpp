

#include <gmock/gmock.h>

#include <cmath>

#include "core/physics/testing/bodies.h"

namespace tessera::physics {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(RayTest, HitsTheNearestWhereItIs) {
  World world({.origin = {1000, 0, 0}});
  AddAll(world, {Dynamic(2, Ball(), {1005, 0, 0}), Dynamic(3, Cube(), {1010, 0, 0}), Static(4, Ground(), {0, -5, 0})});
  const auto hit = world.CastRay({1000, 0.3, 0}, {1020, 0.3, 0});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->body, BodyId(2));
  const double x = 5 - std::sqrt(0.25 - 0.09);
  EXPECT_NEAR(hit->fraction, x / 20, 1e-4);
  EXPECT_NEAR(hit->point.x, 1000 + x, 2e-3);
  EXPECT_NEAR(hit->normal.x, -0.8, 1e-2);
  EXPECT_NEAR(hit->normal.y, 0.6, 1e-2);
  const auto box = world.CastRay({1020, 0.3, 0}, {1000, 0.3, 0});
  ASSERT_TRUE(box.has_value());
  EXPECT_EQ(box->body, BodyId(3));
  EXPECT_NEAR(box->point.x, 1010.5, 2e-3);
  EXPECT_NEAR(box->normal.x, 1, 1e-3);
  const auto down = world.CastRay({990, 5, 30}, {990, -15, 30});
  ASSERT_TRUE(down.has_value());
  EXPECT_EQ(down->body, BodyId(4));
  EXPECT_NEAR(down->fraction, 0.5, 1e-4);
  EXPECT_FALSE(world.CastRay({1000, 3, 0}, {1020, 3, 0}).has_value());
  EXPECT_FALSE(world.CastRay({1000, 0.3, 0}, {1004, 0.3, 0}).has_value());
}

TEST(RayTest, PassesThroughTriggers) {
  World world({});
  BodyDef trigger = Static(2, Ball(), {5, 0, 0});
  trigger.trigger = true;
  AddAll(world, {trigger, Static(3, Ball(), {8, 0, 0})});
  const auto hit = world.CastRay({}, {10, 0, 0});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->body, BodyId(3));
}

TEST(RayTest, SeesBodiesWhereTheLastStepLeftThem) {
  World world({.gravity_m_s2 = {}});
  BodyDef fast = Dynamic(2, Ball(), {});
  fast.initial.linear_velocity = {600, 0, 0};
  world.Add(fast, fast.initial);
  for (int i = 1; i <= 5; ++i) {
    world.Step(kDt);
    const double x = world.StateOf(fast.id).position.x;
    EXPECT_NEAR(x, 10 * i, 1e-3);
    EXPECT_TRUE(world.CastRay({x, 5, 0}, {x, -5, 0}).has_value());
    EXPECT_FALSE(world.CastRay({x - 10, 5, 0}, {x - 10, -5, 0}).has_value());
    EXPECT_THAT(world.Overlapping(Aabb{{x - 0.1, -1, -1}, {x + 0.1, 1, 1}}), ElementsAre(fast.id));
  }
}

TEST(OverlapTest, OfAShapeIsExact) {
  World world({});
  AddAll(world, {Static(9, Ground(), {0, -10, 0}), Dynamic(7, Ball(), {3, 3, 0}), Dynamic(2, Cube(), {-3, 0, 0})});
  const Shape ball{SphereShape{1}};
  // Bounds overlap at (1, 1); the balls themselves, 2.8 m apart and 1.5 m long, do not.
  EXPECT_THAT(world.Overlapping(ball, {{1.6, 1.6, 0}, {}}), IsEmpty());
  EXPECT_THAT(world.Overlapping(ball, {{2.0, 2.0, 0}, {}}), ElementsAre(BodyId(7)));
  const Shape rod{BoxShape{{6, 0.1, 0.1}}};
  EXPECT_THAT(world.Overlapping(rod, {{0, 0, 0}, {}}), ElementsAre(BodyId(2)));
  const double s = std::sin(0.39269908), c = std::cos(0.39269908);  // 45 degrees about z: through (3, 3)
  EXPECT_THAT(world.Overlapping(rod, {{0, 0, 0}, {0, 0, s, c}}), ElementsAre(BodyId(7)));
  EXPECT_THAT(world.Overlapping(ball, {{50, -10.5, 3}, {}}), ElementsAre(BodyId(9)));
  EXPECT_THAT(world.Overlapping({SphereShape{8}}, {{0, 0, 0}, {}}), ElementsAre(BodyId(2), BodyId(7)));
}

TEST(OverlapTest, OfABoxGoesByBounds) {
  World world({});
  AddAll(world, {Dynamic(7, Ball(), {3, 3, 0}), Dynamic(2, Cube(), {-3, 0, 0})});
  EXPECT_THAT(world.Overlapping(Aabb{{2, 2, -1}, {2.51, 2.51, 1}}), ElementsAre(BodyId(7)));
  EXPECT_THAT(world.Overlapping(Aabb{{2, 2, -1}, {2.49, 2.49, 1}}), IsEmpty());
  EXPECT_THAT(world.Overlapping(Aabb{{-9, -9, -9}, {9, 9, 9}}), ElementsAre(BodyId(2), BodyId(7)));
}

TEST(OverlapTest, LeavesTheWorldAsItWas) {
  const auto run = [](bool ask) {
    World world({});
    AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.8, 0}), Dynamic(3, Cube(), {0.2, 2, 0.1})});
    for (int i = 0; i < 120; ++i) {
      world.Step(kDt);
      if (!ask) continue;
      world.Overlapping({SphereShape{2}}, {{0, 1, 0}, {}});
      world.CastRay({0, 5, 0}, {0, -5, 0});
    }
    return world.StateOf(BodyId(3));
  };
  EXPECT_EQ(run(false), run(true));
}

}  // namespace
}  // namespace tessera::physics
