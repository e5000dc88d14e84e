// Bullet's shapes against our own geometries: queries and contacts must agree about where things are.
#include "core/physics/bullet_shapes.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/physics/bullet_math.h"
#include "core/physics/collide/testing/surfaces.h"

namespace tessera::physics {
namespace {

Bounds BoundsInBullet(const Geometry& geometry, const Mat3f& rotation) {
  const std::shared_ptr<btCollisionShape> shape = MakeBulletShape(geometry);
  btVector3 low, high;
  shape->getAabb(btTransform(ToBullet(rotation), btVector3(0, 0, 0)), low, high);
  return {FromBullet(low), FromBullet(high)};
}

struct CollectTriangles : btTriangleCallback {
  std::vector<std::array<Vec3f, 3>> triangles;
  void processTriangle(btVector3* v, int, int) override {
    triangles.push_back({FromBullet(v[0]), FromBullet(v[1]), FromBullet(v[2])});
  }
};

std::vector<std::array<Vec3f, 3>> TrianglesInBullet(const Geometry& geometry) {
  const std::shared_ptr<btCollisionShape> shape = MakeBulletShape(geometry);
  CollectTriangles collect;
  static_cast<btConcaveShape&>(*shape).processAllTriangles(&collect, {-1e4, -1e4, -1e4}, {1e4, 1e4, 1e4});
  return collect.triangles;
}

std::vector<std::array<Vec3f, 3>> TrianglesOfSweeps(const Geometry& geometry) {
  std::vector<std::uint32_t> found;
  geometry.surface->TrianglesIn({{-1e4, -1e4, -1e4}, {1e4, 1e4, 1e4}}, &found);
  std::vector<std::array<Vec3f, 3>> triangles;
  triangles.reserve(found.size());
  for (const std::uint32_t t : found) triangles.push_back(geometry.surface->RoundedCorners(t));
  return triangles;
}

float Bumps(float x, float z) { return std::sin(3 * x) + 0.3f * z; }

// A height field in the frame that a static body has it in.
std::shared_ptr<const Geometry> CentredField(double spacing_m) {
  HeightFieldShape field{.columns = 9, .rows = 6, .spacing_m = spacing_m, .heights_m = {}};
  for (int i = 0; i < 54; ++i) field.heights_m.push_back(Bumps(0.37f * static_cast<float>(i), 0.11f));
  const auto [low, high] = std::minmax_element(field.heights_m.begin(), field.heights_m.end());
  return MakeGeometry({field}, {.origin = {0, (static_cast<double>(*low) + *high) / 2, 0}, .axes = {}});
}

// The edges of hulls and cones are rounded by up to the margin, and Bullet's bounds of round shapes are loose.
TEST(BulletShapesTest, BoundsAreThoseOfTheGeometryToWithinAFewCentimetres) {
  std::vector<std::shared_ptr<const Geometry>> shapes = ConvexShapes();
  shapes.push_back(
      MakeGeometry({CompoundShape{{{{{0.3, 0, 0}, {}}, std::make_shared<const Shape>(Shape{SphereShape{1}})}}}}, {}));
  for (const auto& shape : shapes) {
    const Bounds own = BoundsOf(*shape, {}), bullet = BoundsInBullet(*shape, {});
    for (const auto& [near, far] : {std::pair(own.min, bullet.min), std::pair(bullet.max, own.max)}) {
      for (const float gap : {near.x - far.x, near.y - far.y, near.z - far.z}) {
        EXPECT_GT(gap, -0.02f) << static_cast<int>(shape->kind);
        EXPECT_LT(gap, 0.05f) << static_cast<int>(shape->kind);
      }
    }
  }
}

TEST(BulletShapesTest, SurfacesHaveTheSameBoundsToTheBit) {
  for (const auto& surface : {Grid(8, Bumps), CentredField(0.5), CentredField(0.1)}) {
    for (const Quatd& turn : {Quatd(), About({0, 1, 0}, 0.7), About({1, 2, 3}, 1.1)}) {
      const Bounds own = BoundsOf(*surface, RotationOf(turn)), bullet = BoundsInBullet(*surface, RotationOf(turn));
      EXPECT_EQ(own.min, bullet.min) << turn;
      EXPECT_EQ(own.max, bullet.max) << turn;
    }
  }
}

TEST(BulletShapesTest, SweepsSeeTheSameTrianglesToTheBitInTheSameOrder) {
  for (const auto& surface : {Grid(8, Bumps), UnweldedQuad(), CentredField(0.5), CentredField(0.1)}) {
    EXPECT_EQ(TrianglesOfSweeps(*surface), TrianglesInBullet(*surface));
  }
}

TEST(BulletShapesTest, GeometryHasOneShapeWhileItLives) {
  BulletShapes shapes;
  auto ball = GeometryOf(SphereShape{1});
  const auto box = GeometryOf(BoxShape{{1, 1, 1}});
  btCollisionShape* const made = shapes.Of(ball);
  EXPECT_EQ(shapes.Of(ball), made);
  EXPECT_NE(shapes.Of(box), made);
  EXPECT_EQ(shapes.size(), 2u);
  ball = GeometryOf(SphereShape{2});
  EXPECT_EQ(shapes.Of(ball)->getMargin(), 2) << "a stale entry was taken";
}

}  // namespace
}  // namespace tessera::physics
