// Whole pairs: where in the world, in which order, how often searched, and what goes on from step to step.
#include "core/physics/collide/collide.h"

#include <gmock/gmock.h>

#include <numbers>
#include <utility>

#include "core/physics/collide/testing/shapes.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

using ShapeRef = std::shared_ptr<const Geometry>;
constexpr float kAhead_m = 0.02f;

Placement At(Vec3d position, Quatd orientation = {}) { return {position, orientation, RotationOf(orientation)}; }

Manifolds Once(const Geometry& a, const Placement& at_a, const Geometry& b, const Placement& at_b) {
  PairCache cache;
  Manifolds manifolds;
  Collide({a, at_a}, {b, at_b}, kAhead_m, cache, manifolds);
  return manifolds;
}

float Nearest(const Manifolds& manifolds) {
  float nearest = 1;
  for (const Manifold& m : manifolds)
    for (int i = 0; i < m.count; ++i) nearest = std::min(nearest, m.points[static_cast<std::size_t>(i)].separation_m);
  return nearest;
}

std::vector<ShapeRef> StaticShapes() {
  std::vector<ShapeRef> shapes = ConvexShapes();
  CompoundShape table;
  for (const double x : {-0.6, 0.6})
    table.children.push_back({{{x, -0.2, 0}, {}}, std::make_shared<const Shape>(Shape{BoxShape{{0.1, 0.4, 0.1}}})});
  table.children.push_back({{{0, 0.3, 0}, {}}, std::make_shared<const Shape>(Shape{BoxShape{{0.8, 0.1, 0.5}}})});
  shapes.push_back(GeometryOf(table));
  shapes.push_back(GeometryOf(HeightFieldShape{3, 3, 1.5, {0, 0.2f, 0, 0.1f, 0.3f, 0, 0, 0.1f, 0.2f}}));
  shapes.push_back(
      GeometryOf(TriangleMeshShape{{{-2, 0, -2}, {-2, 0.2f, 2}, {2, 0, 2}, {2, 0, -2}}, {{0, 1, 2}, {0, 2, 3}}}));
  shapes.push_back(GeometryOf(PlaneShape{{0.1, 1, 0.2}, 0.1}));
  return shapes;
}

// Near enough to touch, more often than not; positions in 1/1024 m, so that moving the world rounds nothing.
Placement NearBy(Draw& draw, double reach) {
  Vec3d p = draw.Direction() * draw.In(0.3 * reach, reach);
  p = {std::round(p.x * 1024) / 1024, std::round(p.y * 1024) / 1024, std::round(p.z * 1024) / 1024};
  return At(p, draw.OftenAligned());
}

TEST(CollideTest, GivesTheSameBitsAnywhereInTheWorld) {
  Draw draw(11);
  const std::vector<ShapeRef> movers = ConvexShapes(), others = StaticShapes();
  int touching = 0;
  for (int i = 0; i < 3000; ++i) {
    const Geometry &a = *movers[draw.Index(movers.size())], &b = *others[draw.Index(others.size())];
    const Placement at_a = NearBy(draw, 1.2), at_b = At({}, draw.OftenAligned());
    const Vec3d far{1e7, -3e6, 5e6};
    Placement far_a = at_a, far_b = at_b;
    far_a.position += far, far_b.position += far;
    const Manifolds near = Once(a, at_a, b, at_b), there = Once(a, far_a, b, far_b);
    ASSERT_EQ(near.size(), there.size());
    touching += !near.empty();
    for (std::size_t k = 0; k < near.size(); ++k) {
      ASSERT_EQ(near[k].count, there[k].count);
      EXPECT_EQ(near[k].normal, there[k].normal);
      EXPECT_EQ(near[k].key, there[k].key);
      for (std::size_t n = 0; n < static_cast<std::size_t>(near[k].count); ++n) {
        EXPECT_EQ(near[k].points[n].r_a, there[k].points[n].r_a);
        EXPECT_EQ(near[k].points[n].r_b, there[k].points[n].r_b);
        EXPECT_EQ(near[k].points[n].separation_m, there[k].points[n].separation_m);
        EXPECT_EQ(near[k].points[n].feature, there[k].points[n].feature);
      }
    }
  }
  EXPECT_GT(touching, 1000);
}

TEST(CollideTest, IsTheMirrorImageInTheOtherOrder) {
  Draw draw(12);
  const std::vector<ShapeRef> movers = ConvexShapes(), others = StaticShapes();
  for (int i = 0; i < 3000; ++i) {
    const Geometry &a = *movers[draw.Index(movers.size())], &b = *others[draw.Index(others.size())];
    if (&a == &b || a.kind == b.kind) continue;
    const Placement at_a = NearBy(draw, 1.2), at_b = At({}, draw.OftenAligned());
    const Manifolds one = Once(a, at_a, b, at_b), two = Once(b, at_b, a, at_a);
    ASSERT_EQ(one.size(), two.size());
    for (std::size_t k = 0; k < one.size(); ++k) {
      ASSERT_EQ(one[k].count, two[k].count);
      EXPECT_EQ(one[k].normal, -two[k].normal);
      for (std::size_t n = 0; n < static_cast<std::size_t>(one[k].count); ++n) {
        EXPECT_EQ(one[k].points[n].r_a, two[k].points[n].r_b);
        EXPECT_EQ(one[k].points[n].r_b, two[k].points[n].r_a);
        EXPECT_EQ(one[k].points[n].separation_m, two[k].points[n].separation_m);
      }
    }
  }
}

// Points lie midway between the surfaces, seen from both centres alike.
TEST(CollideTest, TellsEachPointFromBothCentresHalfWayBetweenTheSurfaces) {
  const ShapeRef cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  const Placement at_a = At({100, 7, 3}, About({0, 1, 0}, 0.3)), at_b = At({100.1, 8.01, 3.2});
  const Manifolds manifolds = Once(*cube, at_a, *cube, at_b);
  ASSERT_EQ(manifolds.size(), 1u);
  EXPECT_LE(Length(manifolds[0].normal - Vec3f{0, 1, 0}), 1e-6f);
  for (int i = 0; i < manifolds[0].count; ++i) {
    const ManifoldPoint& point = manifolds[0].points[static_cast<std::size_t>(i)];
    EXPECT_NEAR(point.separation_m, 0.01, 1e-6);
    EXPECT_NEAR(point.r_a.y, 0.505, 1e-6);
    EXPECT_LE(Length(point.r_a - point.r_b - Vec3f{0.1f, 1.01f, 0.2f}), 1e-6f);
  }
}

// So it rolls by its radius.
TEST(CollideTest, TellsThePointOfSomethingRoundOnItsSurface) {
  const ShapeRef cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}}), ball = GeometryOf(SphereShape{0.5});
  const ShapeRef capsule = GeometryOf(CapsuleShape{0.5, 0.2});
  const Placement at_a = At({100, 7, 3}, About({0, 1, 0}, 0.3)), at_b = At({100.1, 8.01, 3.2});
  const Placement lying = At({100.1, 8.01, 3.2}, About({1, 0, 0}, std::numbers::pi / 2));
  for (const bool first : {false, true}) {
    for (const auto& [round, at] : {std::pair(ball, at_b), std::pair(capsule, lying)}) {
      const Manifolds manifolds = first ? Once(*round, at, *cube, at_a) : Once(*cube, at_a, *round, at);
      ASSERT_EQ(manifolds.size(), 1u);
      EXPECT_LE(Length(manifolds[0].normal - Vec3f{0, first ? -1.0f : 1.0f, 0}), 1e-6f);
      for (int i = 0; i < manifolds[0].count; ++i) {
        const ManifoldPoint& point = manifolds[0].points[static_cast<std::size_t>(i)];
        EXPECT_NEAR(point.separation_m, 0.01, 1e-6);
        EXPECT_NEAR((first ? point.r_a : point.r_b).y, -0.5, 1e-6);
        EXPECT_NEAR((first ? point.r_b : point.r_a).y, 0.51, 1e-6);
      }
    }
  }
}

// Drifts at random, by little or by much from step to step, and compares with a search from nothing.
void Wander(const ShapeRef& a, const ShapeRef& b, std::uint32_t seed, double slack_m) {
  Draw draw(seed);
  PairCache cache;
  Manifolds manifolds;
  Vec3d position{0.1, 1.1, 0.1};
  Quatd turn = About({0, 1, 0}, 0.2);
  int touching = 0;
  for (int i = 0; i < 6000; ++i) {
    const double stride = i % 1000 < 700 ? 3e-4 : 5e-3;
    position += draw.Direction() * stride + Vec3d{0, 0.2 * stride * (1.0 - position.y), 0};
    position.x *= 0.999, position.z *= 0.999;
    turn = Normalized(About(draw.Direction(), stride) * turn);
    const Placement at_a = At({}), at_b = At(position, turn);
    Collide({*a, at_a}, {*b, at_b}, kAhead_m, cache, manifolds);
    const float found = Nearest(manifolds), truth = Nearest(Once(*a, at_a, *b, at_b));
    touching += !manifolds.empty();
    if (truth < kAhead_m - slack_m) {
      ASSERT_LE(found, truth + slack_m) << "step " << i;
    }
    if (found < kAhead_m) {
      ASSERT_GE(found, truth - slack_m) << "step " << i;
    }
    for (const Manifold& m : manifolds) ASSERT_LE(Nearest({m}), kAhead_m);
  }
  EXPECT_GT(touching, 500);
}

TEST(ReuseTest, BoxesHideNoContact) {
  Wander(GeometryOf(BoxShape{{0.5, 0.5, 0.5}}), GeometryOf(BoxShape{{0.5, 0.5, 0.5}}), 1, 3e-4);
  Wander(GeometryOf(BoxShape{{2, 0.5, 2}}), GeometryOf(BoxShape{{0.5, 0.5, 0.5}}), 2, 3e-4);
}
TEST(ReuseTest, HullsHideNoContact) {
  Wander(GeometryOf(PrismHull(7, 0.5f, 0.5f)), GeometryOf(BoxShape{{0.5, 0.5, 0.5}}), 3, 5e-4);
}
TEST(ReuseTest, CapsulesHideNoContact) {
  Wander(GeometryOf(BoxShape{{2, 0.5, 2}}), GeometryOf(CapsuleShape{0.3, 0.2}), 4, 3e-4);
}
TEST(ReuseTest, CylindersHideNoContact) {
  Wander(GeometryOf(BoxShape{{2, 0.5, 2}}), GeometryOf(CylinderShape{0.3, 0.5}), 5, 3e-4);
}

TEST(ReuseTest, CarriesPointsAlongAFaceExactly) {
  const ShapeRef floor = GeometryOf(BoxShape{{5, 0.5, 5}}), cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  const Placement at_a = At({});
  PairCache cache;
  Manifolds manifolds;
  Collide({*floor, at_a}, {*cube, At({0, 1.001, 0})}, kAhead_m, cache, manifolds);
  const LocalPose searched = cache.pose;
  // A slide, a sink and a tilt that stay within what is reused.
  const Placement moved = At({0.0005, 1.0008, 0.0003}, About({0, 0, 1}, 0.0005));
  Collide({*floor, at_a}, {*cube, moved}, kAhead_m, cache, manifolds);
  EXPECT_EQ(cache.pose.position, searched.position) << "it was searched anew";
  ASSERT_EQ(manifolds.size(), 1u);
  ASSERT_EQ(manifolds[0].count, 4);
  const Manifolds truth = Once(*floor, at_a, *cube, moved);
  for (const ManifoldPoint& point : manifolds[0].points) {
    const auto same = std::find_if(truth[0].points.begin(), truth[0].points.end(),
                                   [&](const ManifoldPoint& p) { return p.feature == point.feature; });
    ASSERT_NE(same, truth[0].points.end());
    EXPECT_NEAR(point.separation_m, same->separation_m, 2e-6);
    EXPECT_LE(Length(point.r_b - same->r_b), 1e-3f);
  }
}

TEST(ReuseTest, KeepsImpulsesByName) {
  const ShapeRef cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  const Placement at_a = At({});
  PairCache cache;
  Manifolds manifolds;
  Collide({*cube, at_a}, {*cube, At({0.2, 1, 0.1})}, kAhead_m, cache, manifolds);
  ASSERT_EQ(manifolds.size(), 1u);
  for (ManifoldPoint& point : manifolds[0].points) {
    point.normal_impulse = point.r_a.x + 2 * point.r_a.z;
    point.total_impulse = 1;
  }
  manifolds[0].friction_impulse = {1, 2, 3};
  manifolds[0].total_friction = {1, 2, 3};
  for (const double x : {0.2001, 0.21}) {  // reused, then searched
    Collide({*cube, at_a}, {*cube, At({x, 1, 0.1})}, kAhead_m, cache, manifolds);
    ASSERT_EQ(manifolds[0].count, 4);
    EXPECT_EQ(manifolds[0].friction_impulse, (Vec3f{1, 2, 3}));
    EXPECT_EQ(manifolds[0].total_friction, Vec3f());
    for (const ManifoldPoint& point : manifolds[0].points) {
      EXPECT_NEAR(point.normal_impulse, point.r_a.x + 2 * point.r_a.z, 0.011);
      EXPECT_EQ(point.total_impulse, 0);
    }
  }
}

// Two corners of a cube that is tilted a little are further away than is asked for, and then are not.
TEST(ReuseTest, PointsThatGoAndComeAgainTakeNobodysImpulse) {
  constexpr float kNear_m = 0.01f;
  const ShapeRef floor = GeometryOf(BoxShape{{5, 0.5, 5}}), cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  const Placement at_a = At({}), low = At({0, 1.0099, 0}), tilted = At({0, 1.0099, 0}, About({0, 0, 1}, 0.001));
  PairCache cache;
  Manifolds manifolds;
  Collide({*floor, at_a}, {*cube, low}, kNear_m, cache, manifolds);
  ASSERT_EQ(manifolds.size(), 1u);
  ASSERT_EQ(manifolds[0].count, 4);
  const LocalPose searched = cache.pose;
  for (ManifoldPoint& point : manifolds[0].points) point.normal_impulse = 1 + point.r_a.z - point.r_a.x;
  for (const auto& [at, count] : {std::pair(tilted, 2), {tilted, 2}, {low, 4}, {low, 4}}) {
    Collide({*floor, at_a}, {*cube, at}, kNear_m, cache, manifolds);
    EXPECT_EQ(cache.pose.position, searched.position) << "it was searched anew";
    ASSERT_EQ(manifolds.size(), 1u);
    ASSERT_EQ(manifolds[0].count, count);
    for (int i = 0; i < count; ++i) {
      const ManifoldPoint& point = manifolds[0].points[static_cast<std::size_t>(i)];
      const bool stayed = point.r_a.x < 0;
      EXPECT_NEAR(point.normal_impulse, stayed ? 1 + point.r_a.z - point.r_a.x : 0, 0.002);
    }
  }
}

TEST(ReuseTest, GivesAnImpulseToTheNearestWhereNamesChange) {
  // The same pair in a cache that has forgotten which face it was: a's face before, b's now.
  const ShapeRef cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  const Placement at_a = At({});
  PairCache cache;
  Manifolds manifolds;
  const Placement upright = At({0, 1, 0});
  Collide({*cube, at_a}, {*cube, upright}, kAhead_m, cache, manifolds);
  for (ManifoldPoint& point : manifolds[0].points) {
    point.normal_impulse = point.r_a.x + 2 * point.r_a.z;
    point.feature += 1000;
  }
  cache = {};
  Collide({*cube, at_a}, {*cube, upright}, kAhead_m, cache, manifolds);
  for (const ManifoldPoint& point : manifolds[0].points)
    EXPECT_NEAR(point.normal_impulse, point.r_a.x + 2 * point.r_a.z, 1e-5);
}

TEST(CollideTest, SeesABoxBeforeItTouches) {
  const ShapeRef floor = GeometryOf(BoxShape{{5, 0.5, 5}}), cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  PairCache cache;
  Manifolds manifolds;
  double first = -1;
  for (double gap = 0.3; gap > -0.01 && first < 0; gap -= 0.004) {
    Collide({*floor, At({})}, {*cube, At({0, 1 + gap, 0})}, kAhead_m, cache, manifolds);
    if (!manifolds.empty()) first = gap;
  }
  EXPECT_GT(first, kAhead_m - 0.0041);
  EXPECT_LE(first, kAhead_m + 1e-6);
  EXPECT_EQ(manifolds[0].count, 4);
}

TEST(CollideTest, LeavesAPairAloneThatIsKnownToBeApart) {
  const ShapeRef cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  PairCache cache;
  Manifolds manifolds;
  Collide({*cube, At({})}, {*cube, At({0, 1.2, 0})}, kAhead_m, cache, manifolds);
  EXPECT_TRUE(manifolds.empty());
  EXPECT_NEAR(cache.apart_m, 0.2, 1e-6);
  const LocalPose searched = cache.pose;
  Collide({*cube, At({})}, {*cube, At({0.05, 1.1, 0})}, kAhead_m, cache, manifolds);
  EXPECT_EQ(cache.pose.position, searched.position);
  Collide({*cube, At({})}, {*cube, At({0.05, 1.01, 0})}, kAhead_m, cache, manifolds);
  EXPECT_EQ(manifolds.size(), 1u);
}

TEST(CollideTest, OnlyWhatIsSearchedSlowlyIsRemembered) {
  const ShapeRef ball = GeometryOf(SphereShape{0.5}), cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}}),
                 plane = GeometryOf(PlaneShape{{0, 1, 0}, 0}), pill = GeometryOf(CapsuleShape{0.4, 0.6});
  const auto remembers = [](const ShapeRef& a, const ShapeRef& b) {
    PairCache cache;
    Manifolds manifolds;
    Collide({*a, At({})}, {*b, At({0, -0.6, 0})}, kAhead_m, cache, manifolds);
    EXPECT_EQ(Remembers(*a, *b), Remembers(*b, *a));
    EXPECT_EQ(Remembers(*a, *b), cache.searched);
    return Remembers(*a, *b);
  };
  EXPECT_TRUE(remembers(cube, cube));
  EXPECT_TRUE(remembers(cube, pill));
  EXPECT_FALSE(remembers(ball, cube));
  EXPECT_FALSE(remembers(pill, ball));
  EXPECT_FALSE(remembers(pill, pill));
  EXPECT_FALSE(remembers(pill, plane));
  EXPECT_FALSE(remembers(cube, plane));
}

TEST(BoundsTest, HoldAShapeTightly) {
  Draw draw(13);
  for (const ShapeRef& shape : ConvexShapes()) {
    for (int i = 0; i < 50; ++i) {
      const Mat3f turn = RotationOf(draw.Turn());
      const Bounds bounds = BoundsOf(*shape, turn);
      // A plane just below touches, and just a little further no more.
      const auto touches = [&](Vec3f up, float offset) {
        LocalManifold m;
        CollidePlane(*shape, {Into(turn, up), offset}, 0, &m);
        return m.count > 0;
      };
      const float e = 1e-4f;
      EXPECT_TRUE(touches({1, 0, 0}, bounds.min.x + e) && touches({0, 1, 0}, bounds.min.y + e) &&
                  touches({0, 0, 1}, bounds.min.z + e));
      EXPECT_FALSE(touches({1, 0, 0}, bounds.min.x - e) || touches({0, 1, 0}, bounds.min.y - e) ||
                   touches({0, 0, 1}, bounds.min.z - e));
      EXPECT_TRUE(touches({-1, 0, 0}, -bounds.max.x + e) && touches({0, -1, 0}, -bounds.max.y + e) &&
                  touches({0, 0, -1}, -bounds.max.z + e));
      EXPECT_FALSE(touches({-1, 0, 0}, -bounds.max.x - e) || touches({0, -1, 0}, -bounds.max.y - e) ||
                   touches({0, 0, -1}, -bounds.max.z - e));
    }
  }
}

TEST(BoundsTest, RadiiHoldFromInsideAndOutside) {
  Draw draw(14);
  for (const ShapeRef& shape : ConvexShapes()) {
    const Bounds straight = BoundsOf(*shape, {});
    for (int i = 0; i < 500; ++i) {
      // The lowest point along any direction lies between the two balls.
      LocalManifold m;
      const Vec3f up(draw.Direction());
      CollidePlane(*shape, {up, -shape->inner_radius_m + 1e-5f}, 0, &m);
      EXPECT_GT(m.count, 0);
      CollidePlane(*shape, {up, -shape->outer_radius_m - 1e-5f}, 0, &m);
      EXPECT_EQ(m.count, 0);
    }
    EXPECT_GT(shape->middle_radius_m, 0);
    EXPECT_LE(shape->middle.y + shape->middle_radius_m, straight.max.y + 1e-5f);
  }
}

}  // namespace
}  // namespace tessera::physics
