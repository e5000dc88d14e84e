// Rays against shapes, compared with their closed forms, and with a count of points that lie inside.
#include "core/physics/query/ray.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/physics/collide/testing/shapes.h"

namespace tessera::physics {
namespace {

// Whether a point lies in a convex shape, straight from its definition.
bool HoldsPoint(const Geometry& g, Vec3d p) {
  const double across = std::hypot(p.x, p.z);
  switch (g.kind) {
    case GeometryKind::kSphere:
      return Length(p) <= g.radius_m;
    case GeometryKind::kCapsule: {
      const double up = std::max(0.0, std::abs(p.y) - g.half_height_m);
      return std::hypot(across, up) <= g.radius_m;
    }
    case GeometryKind::kBox:
      return std::abs(p.x) <= g.half_extents_m.x && std::abs(p.y) <= g.half_extents_m.y &&
             std::abs(p.z) <= g.half_extents_m.z;
    case GeometryKind::kCylinder:
      return across <= g.radius_m && std::abs(p.y) <= g.half_height_m;
    case GeometryKind::kCone: {
      const double height = 2.0 * g.half_height_m, above = p.y - g.base_y_m;
      return above >= 0 && above <= height && across <= g.radius_m * (1 - above / height);
    }
    default:
      for (const Polyhedron::Face& face : g.polyhedron->faces) {
        if (Dot(Vec3d(face.normal), p) > face.offset_m) return false;
      }
      return true;
  }
}

Vec3d SomePoint(std::mt19937& random, double within) {
  std::uniform_real_distribution<double> one(-within, within);
  const double x = one(random), y = one(random), z = one(random);
  return {x, y, z};
}

// The first point inside, by small steps and bisection; 2 if there is none.
double FirstInside(const Geometry& g, const LocalRay& ray) {
  constexpr int kSteps = 2000;
  for (int i = 0; i <= kSteps; ++i) {
    double high = static_cast<double>(i) / kSteps, low = std::max(0.0, high - 1.0 / kSteps);
    if (!HoldsPoint(g, ray.At(high))) continue;
    if (i == 0) return 0;
    for (int k = 0; k < 60; ++k) (HoldsPoint(g, ray.At((low + high) / 2)) ? high : low) = (low + high) / 2;
    return high;
  }
  return 2;
}

TEST(RayAtShapeTest, EntersEveryConvexShapeWhereItsPointsBegin) {
  std::mt19937 random(1);
  for (const auto& shape : ConvexShapes()) {
    int hits = 0;
    for (int i = 0; i < 300; ++i) {
      const LocalRay ray{SomePoint(random, 1.5), SomePoint(random, 3)};
      const double first = FirstInside(*shape, ray);
      const std::optional<SurfaceHit> hit = HitConvex(*shape, ray);
      if (first > 1) {
        // A ray that only clips a rim may pass between two of the steps.
        if (hit) {
          EXPECT_FALSE(HoldsPoint(*shape, ray.At(hit->fraction + 1.0 / 1000))) << static_cast<int>(shape->kind);
        }
        continue;
      }
      ASSERT_TRUE(hit.has_value()) << static_cast<int>(shape->kind) << ' ' << ray.from << ' ' << ray.along;
      EXPECT_NEAR(hit->fraction, first, 1e-6) << static_cast<int>(shape->kind) << ' ' << ray.from << ' ' << ray.along;
      EXPECT_NEAR(Length(hit->normal), 1, 1e-6);
      EXPECT_LE(Dot(hit->normal, ray.along), 0);
      if (hit->fraction > 0) {
        // The normal leads out, and what is across it is the surface.
        EXPECT_FALSE(HoldsPoint(*shape, hit->point + hit->normal * 1e-4));
        EXPECT_TRUE(HoldsPoint(*shape, hit->point - hit->normal * 1e-4) || Length(hit->point) > 0.3);
      }
      ++hits;
    }
    EXPECT_GT(hits, 10) << static_cast<int>(shape->kind);
  }
}

TEST(RayAtShapeTest, IsExactFromFarAway) {
  const auto ball = GeometryOf(SphereShape{0.5});
  const auto hit = HitConvex(*ball, {{-9000, 0.3, 0}, {10000, 0, 0}});
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->point.x, -0.4, 1e-9);
  EXPECT_NEAR(hit->normal.x, -0.8, 1e-7);
  EXPECT_NEAR(hit->normal.y, 0.6, 1e-7);
  const auto capsule = GeometryOf(CapsuleShape{0.3, 0.5});
  const auto side = HitConvex(*capsule, {{-9000, 0.2, 0}, {10000, 0, 0}});
  ASSERT_TRUE(side.has_value());
  EXPECT_NEAR(side->point.x, -static_cast<double>(0.3f), 1e-9);
  const auto cap = HitConvex(*capsule, {{0, 9000, 0}, {0, -10000, 0}});
  ASSERT_TRUE(cap.has_value());
  EXPECT_NEAR(cap->point.y, 0.5 + static_cast<double>(0.3f), 1e-9);
}

TEST(RayAtShapeTest, SeesAConeFromItsTipItsSideAndBelow) {
  const auto cone = GeometryOf(ConeShape{1, 2});  // from y = -1 to 1
  const auto tip = HitConvex(*cone, {{0, 5, 0}, {0, -10, 0}});
  ASSERT_TRUE(tip.has_value());
  EXPECT_NEAR(tip->fraction, 0.4, 1e-9);
  const auto side = HitConvex(*cone, {{-5, 0, 0}, {10, 0, 0}});
  ASSERT_TRUE(side.has_value());
  EXPECT_NEAR(side->point.x, -0.5, 1e-9);
  EXPECT_NEAR(side->normal.x, -2 / std::sqrt(5.0), 1e-9);
  EXPECT_NEAR(side->normal.y, 1 / std::sqrt(5.0), 1e-9);
  const auto below = HitConvex(*cone, {{0.5, -5, 0}, {0, 10, 0}});
  ASSERT_TRUE(below.has_value());
  EXPECT_NEAR(below->fraction, 0.4, 1e-9);
  EXPECT_EQ(below->normal, (Vec3d{0, -1, 0}));
  EXPECT_FALSE(HitConvex(*cone, {{-5, 1.5, 0}, {10, 0, 0}}).has_value()) << "the other half of the double cone";
  const auto along = HitConvex(*cone, {{1, 0, 0}, {-1, 2, 0}});  // along the side's slope, outside of it
  EXPECT_FALSE(along.has_value());
}

TEST(RayAtShapeTest, BeginsInsideAtOnceAndLeavesWithoutAHit) {
  const auto box = GeometryOf(BoxShape{{1, 1, 1}});
  const auto inside = HitConvex(*box, {{0.5, 0, 0}, {0, 4, 0}});
  ASSERT_TRUE(inside.has_value());
  EXPECT_EQ(inside->fraction, 0);
  EXPECT_EQ(inside->normal, (Vec3d{0, -1, 0}));
  EXPECT_EQ(inside->point, (Vec3d{0.5, 0, 0}));
  EXPECT_FALSE(HitConvex(*box, {{0, 1, 0}, {0, 4, 0}}).has_value());
  EXPECT_FALSE(HitConvex(*box, {{0, 3, 0}, {0, -1.9, 0}}).has_value()) << "it ends before";
}

TEST(RayAtShapeTest, HitsAPlaneFromAboveAndIsInItBelow) {
  const auto plane = GeometryOf(PlaneShape{{0, 2, 0}, 6});  // y = 3
  const auto hit = HitPlane(*plane, {{7, 13, 0}, {0, -20, 5}});
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->fraction, 0.5, 1e-9);
  EXPECT_EQ(hit->normal, (Vec3d{0, 1, 0}));
  EXPECT_FALSE(HitPlane(*plane, {{7, 13, 0}, {0, 20, 5}}).has_value());
  EXPECT_EQ(HitPlane(*plane, {{7, 1, 0}, {0, 20, 5}})->fraction, 0);
}

TEST(RayAtShapeTest, HitsATriangleFromBothSidesAndItsEdges) {
  const std::array<Vec3d, 3> corners{{{0, 0, 0}, {0, 0, 3}, {3, 0, 0}}};  // looks up
  const auto above = HitTriangle(corners, {{1, 2, 1}, {0, -4, 0}});
  ASSERT_TRUE(above.has_value());
  EXPECT_NEAR(above->fraction, 0.5, 1e-12);
  EXPECT_EQ(above->normal, (Vec3d{0, 1, 0}));
  const auto below = HitTriangle(corners, {{1, -2, 1}, {0, 4, 0}});
  ASSERT_TRUE(below.has_value());
  EXPECT_EQ(below->normal, (Vec3d{0, -1, 0}));
  EXPECT_FALSE(HitTriangle(corners, {{2, 2, 2}, {0, -4, 0}}).has_value());
  EXPECT_FALSE(HitTriangle(corners, {{1, 2, 1}, {0, -1.9, 0}}).has_value());
  EXPECT_TRUE(HitTriangle(corners, {{1.5, 2, 1.5}, {0, -4, 0}}).has_value()) << "its rim";
}

}  // namespace
}  // namespace tessera::physics
