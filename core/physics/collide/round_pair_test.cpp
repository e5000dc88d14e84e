// Spheres and capsules against everything that has a form of its own.
#include <gmock/gmock.h>

#include "core/physics/collide/primary_pairs.h"
#include "core/physics/collide/testing/brute_force.h"
#include "core/physics/collide/testing/shapes.h"

namespace tessera::physics {
namespace {

using ShapeRef = std::shared_ptr<const Geometry>;

LocalManifold Search(const Geometry& a, const Geometry& b, const Pose& b_in_a, float speculative_m = 0.02f) {
  ConvexCache cache;
  LocalManifold m;
  CollideConvex(a, b, LocalOf(b_in_a), speculative_m, cache, &m);
  return m;
}

void ExpectPoint(const LocalPoint& point, Vec3f on_a, Vec3f on_b, float separation) {
  EXPECT_LE(Length(point.on_a - on_a), 1e-6f) << point.on_a;
  EXPECT_LE(Length(point.on_b - on_b), 1e-6f) << point.on_b;
  EXPECT_NEAR(point.separation_m, separation, 1e-6);
}

TEST(RoundPairTest, SpheresTouchOnTheLineOfTheirCentres) {
  const ShapeRef small = GeometryOf(SphereShape{0.25}), large = GeometryOf(SphereShape{1});
  for (const auto& [a, b] : {std::pair{small, large}, std::pair{large, small}}) {
    const LocalManifold m = Search(*a, *b, {{0, 0, 1.255}, About({1, 2, 3}, 1)});
    ASSERT_EQ(m.count, 1);
    EXPECT_LE(Length(m.normal - Vec3f{0, 0, 1}), 1e-6f);
    ExpectPoint(m.points[0], {0, 0, a->radius_m}, {0, 0, 1.255f - b->radius_m}, 0.005f);
  }
  EXPECT_EQ(Search(*small, *large, {{0, 0, 1.28}, {}}).count, 0);
  const LocalManifold same = Search(*large, *large, {});
  ASSERT_EQ(same.count, 1);
  EXPECT_NEAR(Length(same.normal), 1, 1e-6);
  EXPECT_NEAR(same.points[0].separation_m, -2, 1e-6);
}

TEST(RoundPairTest, ASphereInsideABoxLeavesByTheNearestFace) {
  const ShapeRef ball = GeometryOf(SphereShape{0.1}), box = GeometryOf(BoxShape{{1, 2, 3}});
  const LocalManifold m = Search(*box, *ball, {{0.2, -1.7, 0.5}, {}});
  ASSERT_EQ(m.count, 1);
  EXPECT_EQ(m.normal, (Vec3f{0, -1, 0}));
  ExpectPoint(m.points[0], {0.2f, -2, 0.5f}, {0.2f, -1.6f, 0.5f}, -0.4f);
  // Seen from the ball: the other way about.
  const LocalManifold other = Search(*ball, *box, {{-0.2, 1.7, -0.5}, {}});
  ASSERT_EQ(other.count, 1);
  EXPECT_EQ(other.normal, (Vec3f{0, 1, 0}));
  ExpectPoint(other.points[0], {0, 0.1f, 0}, {0, -0.3f, 0}, -0.4f);
}

TEST(RoundPairTest, CapsulesSideBySideTouchAtBothEndsOfWhatTheyShare) {
  const ShapeRef capsule = GeometryOf(CapsuleShape{0.4, 0.6});
  for (const double angle : {0.0, std::acos(-1.0)}) {
    const LocalManifold m = Search(*capsule, *capsule, {{0.805, 0.5, 0}, About({1, 0, 0}, angle)});
    ASSERT_EQ(m.count, 2);
    EXPECT_LE(Length(m.normal - Vec3f{1, 0, 0}), 1e-6f);
    ExpectPoint(m.points[0], {0.4f, -0.1f, 0}, {0.405f, -0.1f, 0}, 0.005f);
    ExpectPoint(m.points[1], {0.4f, 0.6f, 0}, {0.405f, 0.6f, 0}, 0.005f);
  }
}

TEST(RoundPairTest, CapsulesEndToEndTouchAtOnePoint) {
  const ShapeRef capsule = GeometryOf(CapsuleShape{0.4, 0.6});
  const LocalManifold m = Search(*capsule, *capsule, {{0, 2.01, 0}, {}});
  ASSERT_EQ(m.count, 1);
  EXPECT_LE(Length(m.normal - Vec3f{0, 1, 0}), 1e-6f);
  EXPECT_NEAR(m.points[0].separation_m, 0.01, 1e-6);
}

TEST(RoundPairTest, CrossedCapsulesTouchWhereTheyCross) {
  const ShapeRef capsule = GeometryOf(CapsuleShape{0.4, 0.6});
  const LocalManifold m = Search(*capsule, *capsule, {{0.79, 0.1, 0.2}, About({1, 0, 0}, 1.5)});
  ASSERT_EQ(m.count, 1);
  EXPECT_LE(Length(m.normal - Vec3f{1, 0, 0}), 1e-6f);
  EXPECT_NEAR(m.points[0].separation_m, -0.01, 1e-6);
  const LocalManifold deep = Search(*capsule, *capsule, {{}, About({1, 0, 0}, 1.5)});
  ASSERT_EQ(deep.count, 1);
  EXPECT_LE(std::abs(deep.normal.y), 1e-6);
  EXPECT_NEAR(deep.points[0].separation_m, -0.8, 1e-6);
}

TEST(RoundPairTest, ACapsuleLiesOnABoxAtBothEnds) {
  const ShapeRef capsule = GeometryOf(CapsuleShape{0.2, 0.5}), box = GeometryOf(BoxShape{{1, 0.5, 1}});
  const Quatd lying = About({0, 0, 1}, std::acos(-1.0) / 2);
  const LocalManifold m = Search(*box, *capsule, {{0.1, 0.702, 0.3}, lying});
  ASSERT_EQ(m.count, 2);
  EXPECT_EQ(m.normal, (Vec3f{0, 1, 0}));
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(m.points[static_cast<std::size_t>(i)].separation_m, 0.002, 1e-6);
  EXPECT_NEAR(std::abs(m.points[0].on_a.x - m.points[1].on_a.x), 1, 1e-5);
  // Half of it over the rim: from there to the inner end.
  const LocalManifold over = Search(*box, *capsule, {{1, 0.702, 0.3}, lying});
  ASSERT_EQ(over.count, 2);
  EXPECT_NEAR(std::max(over.points[0].on_a.x, over.points[1].on_a.x), 1, 1e-5);
  EXPECT_NEAR(std::min(over.points[0].on_a.x, over.points[1].on_a.x), 0.5, 1e-5);
}

TEST(RoundPairTest, ACapsuleAlongAnEdgeTouchesItAtBothEnds) {
  const ShapeRef capsule = GeometryOf(CapsuleShape{0.2, 0.5}), box = GeometryOf(BoxShape{{1, 0.5, 1}});
  const double out = 0.205 * std::sqrt(0.5);
  const LocalManifold m = Search(*box, *capsule, {{0.7, 0.5 + out, 1 + out}, About({0, 0, 1}, std::acos(-1.0) / 2)});
  ASSERT_EQ(m.count, 2);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(m.points[static_cast<std::size_t>(i)].separation_m, 0.005, 1e-6);
  EXPECT_NEAR(m.points[0].on_a.x + m.points[1].on_a.x, 1 + 0.2, 1e-5);  // from .2 to the corner at 1
}

float RadiusOf(const Geometry& round) { return round.radius_m; }

// A capsule or sphere is a segment or point with a radius about it.
Polyhedron CoreOf(const Geometry& round) {
  Polyhedron core;
  core.vertices = {{0, -round.half_height_m, 0}, {0, round.half_height_m, 0}};
  core.edges = {{0, 1, 0, 0}};
  return core;
}

void CheckRound(const Geometry& a, const Geometry& b, const LocalPose& pose, const LocalManifold& m) {
  const Polyhedron core = CoreOf(b);
  const Solid p = SolidOf(a), q{&core, Vec3d(pose.position), pose.rotation};
  double gap = LargestGap(p, q);
  if (gap > 0) gap = DistanceOf(p, q);
  const double truth = gap - RadiusOf(b);
  if (m.count == 0) {
    EXPECT_GT(truth, 0.02 - 1e-5);
    return;
  }
  const double tolerance = 2e-3 * (RadiusOf(b) + std::abs(truth)) + 1e-5;
  EXPECT_NEAR(Nearest(m), truth, tolerance);
  EXPECT_NEAR(Length(m.normal), 1, 1e-5);
  for (int i = 0; i < m.count; ++i) {
    const LocalPoint& point = m.points[static_cast<std::size_t>(i)];
    EXPECT_LE(Length(point.on_b - point.on_a - m.normal * point.separation_m), 5e-6);
    const double from_core = DistanceToSegment(Vec3d(point.on_b), q.Vertex(0), q.Vertex(1));
    EXPECT_LE(from_core, RadiusOf(b) + 1e-5);
    EXPECT_LE(point.separation_m, 0.02f);
  }
}

void CheckMany(const std::vector<ShapeRef>& solids, const std::vector<ShapeRef>& rounds, std::uint32_t seed) {
  Draw draw(seed);
  int touching = 0, deep = 0;
  constexpr int kRounds = 6000;
  for (int i = 0; i < kRounds && !testing::Test::HasFailure(); ++i) {
    const Geometry &a = *solids[draw.Index(solids.size())], &b = *rounds[draw.Index(rounds.size())];
    const Quatd turn = draw.OftenAligned();
    const Vec3d direction = draw.In(0, 1) < 0.2 ? Vec3d{0, 1, 0} : draw.Direction();
    const Polyhedron core = CoreOf(b);
    const Solid p = SolidOf(a), q{&core, {}, RotationOf(turn)};
    const double reach = p.Most(direction) + q.Most(-direction) + RadiusOf(b) + draw.In(-0.7, 0.03);
    const LocalPose pose = LocalOf({direction * reach + Cross(direction, draw.Direction()) * draw.In(0, 0.5), turn});
    ConvexCache cache;
    LocalManifold m;
    CollideConvex(a, b, pose, 0.02f, cache, &m);
    SCOPED_TRACE(testing::Message() << "round " << i);
    CheckRound(a, b, pose, m);
    touching += m.count > 0;
    deep += m.count > 0 && Nearest(m) < -RadiusOf(b);
  }
  EXPECT_GT(touching, kRounds / 4);
  EXPECT_GT(deep, kRounds / 20);
}

TEST(RoundPairTest, BoxesTellTrueDistancesAndDepths) {
  CheckMany({GeometryOf(BoxShape{{0.5, 0.5, 0.5}}), GeometryOf(BoxShape{{0.5, 0.3, 0.7}}),
             GeometryOf(BoxShape{{0.05, 0.6, 0.3}})},
            {GeometryOf(SphereShape{0.2}), GeometryOf(CapsuleShape{0.2, 0.4}), GeometryOf(CapsuleShape{0.05, 0.5})}, 1);
}

TEST(RoundPairTest, HullsTellTrueDistancesAndDepths) {
  Draw draw(9);
  CheckMany({GeometryOf(CubeHull({0.2f, 0.1f, -0.1f}, 0.4f)), GeometryOf(PrismHull(7, 0.5f, 0.4f)),
             GeometryOf(RandomHull(draw, 12)), GeometryOf(RandomHull(draw, 30))},
            {GeometryOf(SphereShape{0.2}), GeometryOf(CapsuleShape{0.2, 0.4}), GeometryOf(CapsuleShape{0.05, 0.5})}, 2);
}

TEST(PlanePairTest, RestsEveryShapeOnItsLowestPoints) {
  const auto count = [&](const ShapeRef& shape, float offset) {
    LocalManifold m;
    CollidePlane(*shape, {{0, 1, 0}, offset}, 0.02f, &m);
    for (int i = 0; i < m.count; ++i) {
      const LocalPoint& point = m.points[static_cast<std::size_t>(i)];
      EXPECT_EQ(m.normal, (Vec3f{0, -1, 0}));
      EXPECT_NEAR(point.on_b.y, offset, 1e-6);
      EXPECT_NEAR(point.on_a.y - offset, point.separation_m, 1e-6);
    }
    return m.count;
  };
  EXPECT_EQ(count(GeometryOf(BoxShape{{0.5, 0.5, 0.5}}), -0.51f), 4);
  EXPECT_EQ(count(GeometryOf(BoxShape{{0.5, 0.005, 0.5}}), -0.005f), 4);
  EXPECT_EQ(count(GeometryOf(BoxShape{{0.5, 0.5, 0.5}}), -0.53f), 0);
  EXPECT_EQ(count(GeometryOf(SphereShape{0.5}), -0.4f), 1);
  EXPECT_EQ(count(GeometryOf(CapsuleShape{0.2, 0.3}), -0.5f), 1);
  EXPECT_EQ(count(GeometryOf(CubeHull({}, 0.5f)), -0.5f), 4);
  EXPECT_EQ(count(GeometryOf(PrismHull(7, 0.5f, 0.4f)), -0.4f), 4);
}

TEST(PlanePairTest, LosesNothingWhereThePlaneIsFarAway) {
  const ShapeRef plane = GeometryOf(PlaneShape{{1, 2, 3}, 12345.678});
  Draw draw(3);
  for (int i = 0; i < 200; ++i) {
    // A ball on the plane, far from the plane's origin.
    const Vec3d normal(plane->plane_normal);
    const Vec3d along = Cross(normal, draw.Direction()) * 1e6;
    const Vec3d center = along + normal * ((plane->plane_offset_m + 0.5 - Dot(normal, along)) / Dot(normal, normal));
    const Quatd turn = draw.Turn();
    const LocalPose pose{{}, RotationOf(Conjugate(turn)), center};
    LocalManifold m;
    CollidePlane(*GeometryOf(SphereShape{0.5}), PlaneIn(*plane, pose), 0.02f, &m);
    ASSERT_EQ(m.count, 1);
    EXPECT_NEAR(m.points[0].separation_m, 0, 1e-6);
  }
}

}  // namespace
}  // namespace tessera::physics
