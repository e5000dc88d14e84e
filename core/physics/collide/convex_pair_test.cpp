// Convex pairs by GJK and EPA, against closed forms and against a search over many directions.
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "core/physics/collide/convex_pair.h"
#include "core/physics/collide/testing/shapes.h"

namespace tessera::physics {
namespace {

LocalManifold Collided(const Geometry& a, const Geometry& b, const Pose& pose, float speculative_m = 0.02f) {
  ConvexCache cache;
  LocalManifold m;
  CollideConvexPair(a, b, LocalOf(pose), speculative_m, cache, &m);
  return m;
}

// on_b - on_a = separation * normal at every point, and the normal is one.
void ExpectSound(const LocalManifold& m) {
  if (m.count == 0) return;
  EXPECT_NEAR(Length(m.normal), 1, 1e-5f);
  for (int i = 0; i < m.count; ++i) {
    const LocalPoint& p = m.points[static_cast<std::size_t>(i)];
    ASSERT_TRUE(IsFinite(p.on_a) && IsFinite(p.on_b) && std::isfinite(p.separation_m));
    EXPECT_LT(Length(p.on_b - p.on_a - m.normal * p.separation_m), 1e-4f);
  }
}

TEST(ConvexPairTest, FlushCylinderHasFourPointsAtOnce) {
  const auto box = GeometryOf(BoxShape{{2, 0.5, 2}}), cylinder = GeometryOf(CylinderShape{0.5, 0.6});
  for (const double gap : {0.015, 0.001, 0.0, -0.001, -0.02, -0.2}) {
    SCOPED_TRACE(gap);
    const LocalManifold m = Collided(*box, *cylinder, {{0.3, 1.1 + gap, -0.2}, {}});
    ExpectSound(m);
    ASSERT_EQ(m.count, 4);
    EXPECT_NEAR(m.normal.y, 1, 1e-6f);
    for (const LocalPoint& p : m.points) {
      EXPECT_NEAR(p.separation_m, gap, 1e-5);
      EXPECT_NEAR(p.on_a.y, 0.5, 1e-5);
      EXPECT_NEAR(std::hypot(p.on_a.x - 0.3f, p.on_a.z + 0.2f), 0.5, 1e-5);
    }
  }
}

TEST(ConvexPairTest, StackedCylindersHaveFourPoints) {
  const auto cylinder = GeometryOf(CylinderShape{0.5, 0.6});
  const LocalManifold m = Collided(*cylinder, *cylinder, {{0.1, 1.2, 0}, About({0, 1, 0}, 0.4)});
  ExpectSound(m);
  ASSERT_EQ(m.count, 4);
  EXPECT_NEAR(m.normal.y, 1, 1e-6f);
  for (const LocalPoint& p : m.points) EXPECT_NEAR(p.separation_m, 0, 1e-5);
}

TEST(ConvexPairTest, CylinderOnItsSideHasItsTwoEnds) {
  const auto box = GeometryOf(BoxShape{{2, 0.5, 2}}), cylinder = GeometryOf(CylinderShape{0.5, 0.6});
  for (const double gap : {0.01, -0.001, -0.01}) {
    SCOPED_TRACE(gap);
    const LocalManifold m = Collided(*box, *cylinder, {{0, 1 + gap, 0}, About({0, 0, 1}, std::acos(0.0))});
    ExpectSound(m);
    ASSERT_EQ(m.count, 2);
    EXPECT_NEAR(m.normal.y, 1, 1e-6f);
    for (int i = 0; i < 2; ++i) {
      const LocalPoint& p = m.points[static_cast<std::size_t>(i)];
      EXPECT_NEAR(p.separation_m, gap, 1e-5);
      EXPECT_NEAR(std::abs(p.on_a.x), 0.6, 1e-4);
      EXPECT_NEAR(p.on_a.z, 0, 1e-4);
    }
  }
}

TEST(ConvexPairTest, TiltedCylinderTouchesWithItsRim) {
  const auto box = GeometryOf(BoxShape{{2, 0.5, 2}}), cylinder = GeometryOf(CylinderShape{0.5, 0.6});
  const double tilt = 0.6, reach = 0.6 * std::cos(tilt) + 0.5 * std::sin(tilt);
  for (const double gap : {0.01, -0.002}) {
    SCOPED_TRACE(gap);
    const LocalManifold m = Collided(*box, *cylinder, {{0, 0.5 + reach + gap, 0}, About({0, 0, 1}, tilt)});
    ExpectSound(m);
    ASSERT_EQ(m.count, 1);
    EXPECT_NEAR(m.normal.y, 1, 1e-5f);
    EXPECT_NEAR(m.points[0].separation_m, gap, 1e-5);
    // The lowest point of the rim: on the side to which the axis does not lean.
    EXPECT_NEAR(m.points[0].on_a.x, 0.6 * std::sin(tilt) - 0.5 * std::cos(tilt), 1e-4);
    EXPECT_NEAR(m.points[0].on_a.z, 0, 1e-4);
  }
}

TEST(ConvexPairTest, ConeStandsOnItsBaseAndLiesOnItsSide) {
  const auto box = GeometryOf(BoxShape{{3, 0.5, 3}}), cone = GeometryOf(ConeShape{0.8, 1.2});
  LocalManifold m = Collided(*box, *cone, {{0, 1.1 - 0.001, 0}, {}});
  ExpectSound(m);
  ASSERT_EQ(m.count, 4);
  EXPECT_NEAR(m.normal.y, 1, 1e-6f);
  EXPECT_NEAR(m.points[0].separation_m, -0.001, 1e-5);

  // Side down: its normal, at the angle atan(r / h) over the horizontal, turned to -y.
  const double rise = std::atan2(0.8, 1.2), half_pi = std::acos(0.0);
  const double from_origin = 0.6 * 0.8 / std::hypot(0.8, 1.2);  // distance of the side, from halfway up
  m = Collided(*box, *cone, {{0, 0.5 + from_origin - 0.001, 0}, About({0, 0, 1}, -(half_pi + rise))});
  ExpectSound(m);
  ASSERT_EQ(m.count, 2);
  EXPECT_NEAR(m.normal.y, 1, 1e-5f);
  EXPECT_NEAR(m.points[0].separation_m, -0.001, 2e-5);
  EXPECT_NEAR(m.points[1].separation_m, -0.001, 2e-5);
  EXPECT_NEAR(Length(m.points[0].on_b - m.points[1].on_b), std::hypot(0.8, 1.2), 1e-3);
}

TEST(ConvexPairTest, ParallelCylindersTouchAlongALine) {
  const auto cylinder = GeometryOf(CylinderShape{0.5, 0.6});
  for (const double gap : {0.01, -0.01}) {
    const LocalManifold m = Collided(*cylinder, *cylinder, {{1 + gap, 0.2, 0}, {}});
    ExpectSound(m);
    ASSERT_EQ(m.count, 2);
    EXPECT_NEAR(m.normal.x, 1, 1e-5f);
    EXPECT_NEAR(std::abs(m.points[0].on_a.y - m.points[1].on_a.y), 1.0, 1e-4);
    for (int i = 0; i < 2; ++i) EXPECT_NEAR(m.points[static_cast<std::size_t>(i)].separation_m, gap, 1e-5);
  }
}

TEST(ConvexPairTest, CrossedCylindersTouchInAPoint) {
  const auto cylinder = GeometryOf(CylinderShape{0.5, 0.6});
  const LocalManifold m = Collided(*cylinder, *cylinder, {{0.995, 0, 0}, About({1, 0, 0}, std::acos(0.0))});
  ExpectSound(m);
  ASSERT_EQ(m.count, 1);
  EXPECT_NEAR(m.normal.x, 1, 1e-5f);
  EXPECT_NEAR(m.points[0].separation_m, -0.005, 1e-5);
  EXPECT_NEAR(Length(Vec3f{m.points[0].on_a.x - 0.5f, m.points[0].on_a.y, m.points[0].on_a.z}), 0, 1e-3);
}

// --- Against a search ------------------------------------------------------------------------------------------------

// The largest separation over directions: the distance where the shapes are apart, less the depth where they are not.
// Coarse, then closer about the best.
double BestSeparation(const Convex& a, const Convex& b, std::mt19937& random, Vec3f seed) {
  std::normal_distribution<float> normal;
  Vec3f best = seed;
  float separation = SeparationAlong(a, b, seed);
  for (int i = 0; i < 4000; ++i) {
    const Vec3f n = Normalized(Vec3f{normal(random), normal(random), normal(random)});
    const float s = SeparationAlong(a, b, n);
    if (s > separation) separation = s, best = n;
  }
  for (float spread = 0.1f; spread > 1e-5f; spread *= 0.7f) {
    for (int i = 0; i < 60; ++i) {
      const Vec3f n = Normalized(best + Vec3f{normal(random), normal(random), normal(random)} * spread);
      const float s = SeparationAlong(a, b, n);
      if (s > separation) separation = s, best = n;
    }
  }
  return static_cast<double>(separation);
}

TEST(ConvexPairTest, DistancesAreThoseOfTheTrueSurfaces) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto shapes = ConvexShapes();
  int apart = 0, shallow = 0, deep = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const Geometry& a = *shapes[random() % shapes.size()];
    const Geometry& b = *shapes[random() % shapes.size()];
    const Vec3d way = Normalized(Vec3d{unit(random), unit(random), unit(random)});
    const Quatd turn = Normalized(Quatd{unit(random), unit(random), unit(random), unit(random)});
    // At about the distance where they touch.
    Pose pose{way * 5, turn};
    const double touching = 5 - static_cast<double>(SeparationAlong(AtOrigin(a), Placed(b, LocalOf(pose)), Vec3f(way)));
    pose.position = way * (touching + 0.15 * unit(random));
    const Convex at_a = AtOrigin(a), at_b = Placed(b, LocalOf(pose));
    Gap gap;
    const bool found = FindGap(at_a, at_b, 10, &gap);
    ASSERT_TRUE(found);
    ASSERT_TRUE(IsFinite(gap.normal));
    const double truth = BestSeparation(at_a, at_b, random, gap.normal);
    // Never better than the truth; exact apart; within the inset's rounding in shallow overlap; EPA's guess when deep.
    const double error = truth - static_cast<double>(gap.separation_m);
    if (gap.separation_m > 0) {
      ++apart;
      EXPECT_NEAR(error, 0, 2e-5) << trial << " " << static_cast<int>(a.kind) << static_cast<int>(b.kind);
    } else if (truth > -0.02) {
      ++shallow;
      EXPECT_LT(error, 0.15 * -truth + 1e-4) << trial << " " << static_cast<int>(a.kind) << static_cast<int>(b.kind);
    } else {
      ++deep;
      EXPECT_LT(error, 0.25 * -truth + 1e-3) << trial << " " << static_cast<int>(a.kind) << static_cast<int>(b.kind);
    }
    ConvexCache cache;
    LocalManifold m;
    CollideConvexPair(a, b, LocalOf(pose), 0.02f, cache, &m);
    ExpectSound(m);
    EXPECT_EQ(m.count > 0, gap.separation_m <= 0.02f) << trial;
  }
  EXPECT_GT(apart, 50);
  EXPECT_GT(shallow, 10);
  EXPECT_GT(deep, 50);
}

TEST(ConvexPairTest, DegenerateInputHasAFiniteAnswer) {
  const auto shapes = ConvexShapes();
  const auto needle = GeometryOf(CylinderShape{0.001, 5}), card = GeometryOf(BoxShape{{1, 0.0005, 1}});
  std::vector<const Geometry*> all{needle.get(), card.get()};
  for (const auto& s : shapes) all.push_back(s.get());
  for (const Geometry* a : all) {
    for (const Geometry* b : all) {
      for (const Pose& pose : {Pose{}, Pose{{1e-30, 0, 0}, {}}, Pose{{0, 1e-7, 0}, About({1, 1, 0}, 1e-4)},
                               Pose{{0, 0, 0}, About({0, 0, 1}, std::acos(0.0))}}) {
        const LocalManifold m = Collided(*a, *b, pose);
        ExpectSound(m);
        ASSERT_GT(m.count, 0);
        EXPECT_LT(m.points[0].separation_m, 1e-6f);
      }
    }
  }
}

TEST(ConvexPairTest, SameBitsWhateverCameBefore) {
  const auto cylinder = GeometryOf(CylinderShape{0.5, 0.6}), cone = GeometryOf(ConeShape{0.8, 1.2});
  const Pose pose{{0.3, 1.15, 0.2}, About({1, 2, 3}, 0.1)};
  const LocalManifold first = Collided(*cylinder, *cone, pose);
  ConvexCache cache;
  LocalManifold again;
  CollideConvexPair(*cylinder, *cone, LocalOf({{0.9, 0, 0}, {}}), 0.02f, cache, &again);
  CollideConvexPair(*cylinder, *cone, LocalOf(pose), 0.02f, cache, &again);
  ASSERT_EQ(first.count, again.count);
  EXPECT_EQ(first.normal, again.normal);
  for (int i = 0; i < first.count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_EQ(first.points[k].on_a, again.points[k].on_a);
    EXPECT_EQ(first.points[k].separation_m, again.points[k].separation_m);
  }
}

TEST(RoundPlaneTest, CylinderAndConeStandAndLie) {
  const auto cylinder = GeometryOf(CylinderShape{0.5, 0.6}), cone = GeometryOf(ConeShape{0.8, 1.2});
  LocalManifold m;
  CollideRoundPlane(*cylinder, {{0, 1, 0}, -0.59f}, 0.02f, &m);
  EXPECT_EQ(m.count, 4);
  EXPECT_NEAR(m.points[0].separation_m, -0.01f, 1e-6f);
  EXPECT_EQ(m.normal, (Vec3f{0, -1, 0}));
  CollideRoundPlane(*cylinder, {{1, 0, 0}, -0.51f}, 0.02f, &m);
  EXPECT_EQ(m.count, 2);
  EXPECT_NEAR(m.points[0].separation_m, 0.01f, 1e-6f);
  CollideRoundPlane(*cone, {{0, 1, 0}, -0.6f}, 0.02f, &m);
  EXPECT_EQ(m.count, 4);
  CollideRoundPlane(*cylinder, {{0, 1, 0}, -0.63f}, 0.02f, &m);
  EXPECT_EQ(m.count, 0);
}

}  // namespace
}  // namespace tessera::physics
