// Meshes and height fields against closed forms.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/physics/collide/testing/surfaces.h"

namespace tessera::physics {
namespace {

std::vector<Vec3d> Places() {
  std::vector<Vec3d> places;
  for (int x = -12; x <= 12; ++x) {
    for (int z = -12; z <= 12; ++z) places.push_back({x / 6.0, 0, z / 6.0});  // corners and edges of cells among them
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-2, 2);
  for (int i = 0; i < 300; ++i) places.push_back({unit(random), 0, unit(random)});
  return places;
}

TEST(SurfaceTest, BallOnAFlatSurfaceFeelsNoEdges) {
  const auto ball = GeometryOf(SphereShape{0.3});
  for (const auto& ground : FlatGrounds()) {
    for (const Vec3d& place : Places()) {
      for (const double gap : {0.015, 0.0, -0.004, -0.1}) {
        const LocalManifolds found = On(*ball, *ground, {place + Vec3d{0, 0.3 + gap, 0}, {}});
        ASSERT_EQ(found.size(), 1u) << place << gap;
        ASSERT_EQ(found[0].count, 1) << place << gap;
        EXPECT_EQ(found[0].normal, (Vec3f{0, -1, 0})) << place << gap;
        EXPECT_NEAR(found[0].points[0].separation_m, gap, 1e-6);
        EXPECT_NEAR(found[0].points[0].on_a.x, place.x, 1e-5);
        EXPECT_NEAR(found[0].points[0].on_a.z, place.z, 1e-5);
      }
    }
  }
}

// All points of all manifolds look straight up and none lies deeper than the shape does.
void ExpectFlat(const LocalManifolds& found, double gap) {
  ASSERT_EQ(found.size(), 1u);
  float deepest = 1;
  EXPECT_EQ(found[0].normal.x, 0);
  EXPECT_NEAR(found[0].normal.y, -1, 1e-7f);
  EXPECT_EQ(found[0].normal.z, 0);
  for (int i = 0; i < found[0].count; ++i) {
    deepest = std::min(deepest, found[0].points[static_cast<std::size_t>(i)].separation_m);
  }
  EXPECT_NEAR(deepest, gap, 2e-6);
}

TEST(SurfaceTest, EveryShapeOnAFlatSurfaceFeelsNoEdges) {
  for (const auto& ground : FlatGrounds()) {
    for (const auto& shape : ConvexShapes()) {
      int i = 0;
      for (const Vec3d& place : Places()) {
        if (++i % 3 != 0) continue;
        for (const double gap : {0.01, -0.003}) {
          for (const Quatd& turn : {Quatd{}, About({0, 1, 0}, 0.3), About({1, 0, 2}, 0.4)}) {
            SCOPED_TRACE(testing::Message() << static_cast<int>(shape->kind) << place << gap << turn << " ground "
                                            << static_cast<int>(ground->kind));
            const Bounds bounds = BoundsOf(*shape, RotationOf(turn));
            const LocalManifolds found =
                On(*shape, *ground, {place + Vec3d{0, gap - static_cast<double>(bounds.min.y), 0}, turn});
            // Turned, the axes of the shape are no longer those of the ground: up to rounding, then.
            ASSERT_EQ(found.size(), 1u);
            EXPECT_NEAR(found[0].normal.y, -1, 1e-6f);
            EXPECT_LT(std::hypot(found[0].normal.x, found[0].normal.z), 1e-6f);
            float deepest = 1;
            for (int k = 0; k < found[0].count; ++k) {
              deepest = std::min(deepest, found[0].points[static_cast<std::size_t>(k)].separation_m);
            }
            EXPECT_NEAR(deepest, gap, 2e-6);
            if (testing::Test::HasFailure()) return;
          }
        }
      }
    }
  }
}

TEST(SurfaceTest, BoxOnManyTrianglesStandsOnItsFourCorners) {
  const auto box = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  for (const auto& ground : FlatGrounds()) {
    for (const Vec3d& place : Places()) {
      const LocalManifolds found = On(*box, *ground, {place + Vec3d{0, 0.498, 0}, {}});
      ExpectFlat(found, -0.002);
      ASSERT_EQ(found[0].count, 4);
      std::vector<std::pair<int, int>> corners;
      for (const LocalPoint& p : found[0].points) {
        EXPECT_NEAR(std::abs(p.on_a.x - place.x), 0.5, 2e-5);
        EXPECT_NEAR(std::abs(p.on_a.z - place.z), 0.5, 2e-5);
        corners.emplace_back(p.on_a.x > place.x, p.on_a.z > place.z);
      }
      std::sort(corners.begin(), corners.end());
      EXPECT_EQ(std::unique(corners.begin(), corners.end()) - corners.begin(), 4);
      if (testing::Test::HasFailure()) return;
    }
  }
}

TEST(SurfaceTest, SlidingKeepsTheKeyAndTheCorners) {
  const auto box = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  for (const auto& ground : FlatGrounds()) {
    const LocalManifolds first = On(*box, *ground, {{0.21, 0.499, 0.17}, {}});
    for (int i = 1; i < 100; ++i) {
      const Vec3d place{0.21 + 0.0171 * i, 0.499, 0.17 + 0.011 * i};
      const LocalManifolds found = On(*box, *ground, {place, {}});
      ASSERT_EQ(found.size(), 1u);
      EXPECT_EQ(found[0].key, first[0].key) << i;
      ASSERT_EQ(found[0].count, 4);
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(std::abs(found[0].points[k].on_a.x - place.x), 0.5, 2e-5) << i;
        EXPECT_NEAR(std::abs(found[0].points[k].on_a.z - place.z), 0.5, 2e-5) << i;
        for (std::size_t j = 0; j < k; ++j) EXPECT_NE(found[0].points[j].feature, found[0].points[k].feature);
      }
    }
  }
}

TEST(SurfaceTest, CapsuleLiesOnAMeshWithBothEnds) {
  const auto capsule = GeometryOf(CapsuleShape{0.2, 0.6});
  for (const auto& ground : FlatGrounds()) {
    const LocalManifolds found = On(*capsule, *ground, {{0.13, 0.199, 0.31}, About({0, 0, 1}, std::acos(0.0))});
    ASSERT_EQ(found.size(), 1u);
    float low = 1, high = -1;
    for (int i = 0; i < found[0].count; ++i) {
      const LocalPoint& p = found[0].points[static_cast<std::size_t>(i)];
      EXPECT_NEAR(p.separation_m, -0.001, 1e-5);
      low = std::min(low, p.on_a.x);
      high = std::max(high, p.on_a.x);
    }
    EXPECT_NEAR(low, 0.13 - 0.6, 1e-4);
    EXPECT_NEAR(high, 0.13 + 0.6, 1e-4);
  }
}

// A ridge along z at x = 0, a valley at x = 4.
float Fold(float x, float) { return x < 0 ? 0.5f * x : x < 4 ? -0.5f * x : 0.5f * (x - 8); }

TEST(SurfaceTest, RidgeHasTheNormalsBetweenItsSides) {
  const auto ball = GeometryOf(SphereShape{0.3});
  const double side = std::atan(0.5);
  for (const auto& ground : {Grid(20, Fold), Field(21, 1, Fold)}) {
    for (int i = -10; i <= 10; ++i) {
      const double angle = side * i / 10;  // from straight up
      const Vec3d up{std::sin(angle), std::cos(angle), 0};
      for (const double z : {0.0, 0.25, 0.5}) {
        const LocalManifolds found = On(*ball, *ground, {up * 0.305 + Vec3d{0, 0, z}, {}});
        ASSERT_EQ(found.size(), 1u) << i;
        EXPECT_EQ(found[0].count, 1);
        EXPECT_NEAR(Length(Vec3d(found[0].normal) + up), 0, 1e-5) << i;
        EXPECT_NEAR(found[0].points[0].separation_m, 0.005, 1e-6);
      }
    }
  }
}

TEST(SurfaceTest, ValleyHasTheNormalsOfItsSidesAlone) {
  const auto ball = GeometryOf(SphereShape{0.3});
  const double stretch = std::sqrt(1.25);
  for (const auto& ground : {Grid(20, Fold), Field(21, 1, Fold)}) {
    const LocalManifolds found = On(*ball, *ground, {{4, -2 + 0.3 * stretch - 0.002, 0.3}, {}});
    ASSERT_EQ(found.size(), 2u);
    for (const LocalManifold& m : found) {
      EXPECT_NEAR(std::abs(m.normal.x), 0.5 / stretch, 1e-6);
      EXPECT_NEAR(m.normal.y, -1 / stretch, 1e-6);
      EXPECT_NEAR(m.points[0].separation_m, -0.002 / stretch, 1e-6);
    }
    EXPECT_NE(found[0].key, found[1].key);
  }
}

TEST(SurfaceTest, BoxAcrossARidgeLeansAsTheRidgeLetsIt) {
  // A box whose bottom leans by `angle` and touches the ridge in its middle: the ridge, a line, has the bottom's
  // normal.
  const auto box = GeometryOf(BoxShape{{0.4, 0.1, 0.4}});
  for (const auto& ground : {Grid(20, Fold), Field(21, 1, Fold)}) {
    for (const double angle : {-0.3, -0.1, 0.0, 0.2}) {
      for (const double gap : {0.005, -0.002}) {
        const Quatd turn = About({0, 0, 1}, angle);
        const Vec3d up = Rotate(turn, {0, 1, 0});
        const LocalManifolds found = On(*box, *ground, {up * (0.1 + gap) + Vec3d{0, 0, 0.3}, turn});
        ASSERT_EQ(found.size(), 1u) << angle << " " << gap;
        EXPECT_NEAR(Length(Vec3d(found[0].normal) + up), 0, 2e-3);
        ASSERT_GE(found[0].count, 2);
        float near = 9, far = -9;
        for (int i = 0; i < found[0].count; ++i) {
          near = std::min(near, found[0].points[static_cast<std::size_t>(i)].on_a.z);
          far = std::max(far, found[0].points[static_cast<std::size_t>(i)].on_a.z);
        }
        EXPECT_NEAR(near, -0.1, 1e-2);
        EXPECT_NEAR(far, 0.7, 1e-2);
      }
    }
  }
}

TEST(SurfaceTest, CapsuleEndOverABluntRidgeIsHeld) {
  // Where the prisms over the two sides of a ridge part, neither has the end in it.
  const auto blunt = [](float x, float) { return -0.1f * std::abs(x); };
  const auto capsule = GeometryOf(CapsuleShape{0.3, 0.4});
  for (const auto& ground : {Grid(20, blunt), Field(21, 1, blunt)}) {
    for (double lean = -0.09; lean <= 0.09; lean += 0.01) {
      const Vec3d place{0.305 * std::sin(lean), 0.305 * std::cos(lean), 0.3};
      const LocalManifolds found = On(*capsule, *ground, {place + Vec3d{0, 0.4, 0}, {}});
      ASSERT_EQ(found.size(), 1u) << lean;
      EXPECT_NEAR(found[0].points[0].separation_m, 0.005, 1e-4) << lean;
    }
  }
}

// The top of a cube of triangles, near its rim, with its walls below.
std::shared_ptr<const Geometry> CubeMesh() {
  TriangleMeshShape mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.push_back({i & 1 ? 1.f : -1.f, i & 2 ? 1.f : -1.f, i & 4 ? 1.f : -1.f});
  for (const auto& [a, b, c, d] : std::vector<std::array<std::uint32_t, 4>>{
           {0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  return GeometryOf(mesh);
}

TEST(SurfaceTest, BoxOverTheRimOfATableIsHeldByItsTopAlone) {
  const auto cube = CubeMesh();
  for (const auto& shape :
       {GeometryOf(BoxShape{{0.4, 0.4, 0.4}}), GeometryOf(CylinderShape{0.4, 0.4}), GeometryOf(CubeHull({}, 0.4f))}) {
    for (const double depth : {0.001, 0.005, 0.03}) {
      for (double x = 0.2; x < 1.3; x += 0.0173) {
        const LocalManifolds found = On(*shape, *cube, {{x, 1.4 - depth, 0.1}, {}});
        ASSERT_EQ(found.size(), 1u) << x << " " << depth << " " << static_cast<int>(shape->kind);
        EXPECT_NEAR(found[0].normal.y, -1, 1e-6f) << x;
        EXPECT_NEAR(found[0].points[0].separation_m, -depth, 1e-5) << x;
        EXPECT_LE(found[0].points[0].on_a.x, 1.0001f);
      }
    }
  }
}

TEST(SurfaceTest, WallsOfACubeAreFeltFromTheSide) {
  const auto cube = CubeMesh();
  for (const auto& shape : ConvexShapes()) {
    const Bounds bounds = BoundsOf(*shape, Mat3f{});
    const LocalManifolds found = On(*shape, *cube, {{1 - static_cast<double>(bounds.min.x) - 0.002, 0.1, 0.1}, {}});
    ASSERT_EQ(found.size(), 1u) << static_cast<int>(shape->kind);
    EXPECT_NEAR(found[0].normal.x, -1, 1e-4f);
    EXPECT_NEAR(found[0].points[0].separation_m, -0.002, 1e-4);
  }
}

TEST(SurfaceTest, WhatIsDeepInsideComesOutInFront) {
  const auto ball = GeometryOf(SphereShape{0.3}), box = GeometryOf(BoxShape{{0.3, 0.3, 0.3}});
  for (const auto& ground : {Quad(), Grid(20, Flat), Field(21, 1, Flat)}) {
    for (const auto& shape : {ball, box}) {
      const LocalManifolds found = On(*shape, *ground, {{0.13, -0.1, 0.21}, {}});
      ASSERT_EQ(found.size(), 1u);
      EXPECT_NEAR(found[0].normal.y, -1, 1e-6f);
      EXPECT_NEAR(found[0].points[0].separation_m, -0.4, 1e-5);
    }
  }
}

TEST(SurfaceTest, CardThatPokesThroughASheetComesOutInFront) {
  const auto card = GeometryOf(BoxShape{{0.2, 0.01, 0.12}});
  for (const auto& ground : {Quad(), Grid(20, Flat)}) {
    const LocalManifolds found = On(*card, *ground, {{0.13, -0.03, 0.21}, About({0, 0, 1}, 0.4)});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].normal.y, -1, 1e-6f);
  }
}

TEST(SurfaceTest, CardThatPassedASheetIsFetchedBack) {
  const auto card = GeometryOf(BoxShape{{0.2, 0.01, 0.12}});
  const auto ground = Grid(20, Flat);
  const auto at = [](double y) { return LocalPose{{-0.13f, static_cast<float>(-y), -0.21f}, {}, {0.13, y, 0.21}}; };
  PartCaches parts;
  LocalManifolds found;
  CollideMesh(*card, *ground, at(0.009), 0.02f, parts, &found);
  ASSERT_EQ(found.size(), 1u);
  for (const double y : {-0.1, -0.05, -0.02, -0.009, -0.002}) {
    found.clear();
    CollideMesh(*card, *ground, at(y), 0.02f, parts, &found);
    ASSERT_EQ(found.size(), 1u) << y;
    EXPECT_EQ(found[0].normal, (Vec3f{0, -1, 0}));
    EXPECT_NEAR(found[0].points[0].separation_m, y - 0.01, 1e-6);
  }
  // A shape that never was in front is left alone.
  parts.clear();
  found.clear();
  CollideMesh(*card, *ground, at(-0.1), 0.02f, parts, &found);
  EXPECT_TRUE(found.empty());
}

TEST(SurfaceTest, SheetIsMetFromBelowToo) {
  const auto ball = GeometryOf(SphereShape{0.3}), box = GeometryOf(BoxShape{{0.3, 0.3, 0.3}});
  for (const auto& shape : {ball, box}) {
    const LocalManifolds found = On(*shape, *Quad(), {{0.5, -0.299, -0.6}, {}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].normal.y, 1, 1e-6f);
    EXPECT_NEAR(found[0].points[0].separation_m, -0.001, 1e-5);
  }
}

TEST(SurfaceTest, FarPlacesAreAsExactAsNearOnes) {
  // Corners on whole metres stay exact in float at 100 km; the body's place comes in doubles.
  const Vec3f far{100000, 0, -200000};
  const auto there = Grid(8, Fold, far), here = Grid(8, Fold);
  const auto box = GeometryOf(BoxShape{{0.4, 0.3, 0.5}});
  const Quatd turn = About({0, 0, 1}, std::atan(0.5));
  const Vec3d place{-1.37, -0.685 + 0.3 * std::sqrt(1.25) - 0.001, 0.41};
  const LocalManifolds a = On(*box, *here, {place, turn}), b = On(*box, *there, {place + Vec3d(far), turn});
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GT(a.size(), 0u);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].count, b[i].count);
    for (int k = 0; k < a[i].count; ++k) {
      EXPECT_NEAR(a[i].points[static_cast<std::size_t>(k)].separation_m,
                  b[i].points[static_cast<std::size_t>(k)].separation_m, 1e-7);
    }
  }
}

TEST(SurfaceTest, LargeFieldsAreSmoothEverywhere) {
  const auto field = Field(1201, 0.5, Flat);
  const auto ball = GeometryOf(SphereShape{0.3});
  for (const double x : {-299.0, 0.0, 255.9, 256.0, 298.5}) {
    for (const double z : {-299.0, 0.25, 256.0}) {
      const LocalManifolds found = On(*ball, *field, {{x, 0.299, z}, {}});
      ASSERT_EQ(found.size(), 1u) << x << " " << z;
      EXPECT_EQ(found[0].normal, (Vec3f{0, -1, 0}));
    }
  }
}

TEST(SurfaceTest, SliversAndRepeatedCornersDoNoHarm) {
  TriangleMeshShape mesh;
  mesh.vertices = {{-5, 0, -5}, {5, 0, -5}, {5, 0, 5}, {-5, 0, 5}, {0, 0, 0}, {1, 0, 1e-9f}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {4, 4, 4}, {0, 2, 2}, {4, 2, 0}, {4, 5, 1}};
  const auto ground = GeometryOf(mesh);
  for (const auto& shape : ConvexShapes()) {
    const Bounds bounds = BoundsOf(*shape, Mat3f{});
    for (const Vec3d& place : Places()) {
      for (const LocalManifold& m : On(*shape, *ground, {place - Vec3d{0, static_cast<double>(bounds.min.y), 0}, {}})) {
        ASSERT_TRUE(IsFinite(m.normal));
        ASSERT_GT(m.count, 0);
        EXPECT_NEAR(Length(m.normal), 1, 1e-5f);
      }
    }
  }
}

}  // namespace
}  // namespace tessera::physics
