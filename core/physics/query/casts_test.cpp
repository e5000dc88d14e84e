// Sweeps of shapes against shapes, compared with closed forms and with small steps.
#include "core/physics/query/cast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/physics/collide/gjk.h"
#include "core/physics/collide/testing/shapes.h"
#include "core/physics/query/meet.h"

namespace tessera::physics {
namespace {

std::optional<SurfaceHit> SweepAt(const Geometry& target, const QueryShape& shape, const LocalRay& ray,
                                  Quatd turned = {}) {
  const Probe probe(shape, turned);
  WorkMeter meter(std::numeric_limits<std::uint64_t>::max());
  return Meet(target, {}, ray, &probe, meter);
}

Quatd AboutZ(double angle_rad) { return {0, 0, std::sin(angle_rad / 2), std::cos(angle_rad / 2)}; }

TEST(SweepOfAShapeTest, BallsMeetWhereTheirRadiiAddUp) {
  const auto ball = GeometryOf(SphereShape{0.5});
  for (const double aside : {0.0, 0.4, 0.7, 0.74}) {
    const auto hit = SweepAt(*ball, SphereShape{0.25}, {{-10, aside, 0}, {20, 0, 0}});
    ASSERT_TRUE(hit.has_value()) << aside;
    const double x = -std::sqrt(0.75 * 0.75 - aside * aside);
    EXPECT_NEAR(hit->fraction, (x + 10) / 20, 1e-7) << aside;
    EXPECT_NEAR(hit->normal.x, x / 0.75, 1e-5) << aside;
    EXPECT_NEAR(hit->normal.y, aside / 0.75, 1e-5) << aside;
    EXPECT_NEAR(Length(hit->point), 0.5, 1e-5) << aside;
  }
  EXPECT_FALSE(SweepAt(*ball, SphereShape{0.25}, {{-10, 0.751, 0}, {20, 0, 0}}).has_value());
}

TEST(SweepOfAShapeTest, ABoxLandsOnItsFaceItsEdgeAndItsCorner) {
  const auto floor = GeometryOf(BoxShape{{10, 1, 10}});
  const BoxShape box{{0.5, 0.25, 0.5}};
  const auto flat = SweepAt(*floor, box, {{0, 5, 0}, {0, -10, 0}});
  ASSERT_TRUE(flat.has_value());
  EXPECT_NEAR(flat->fraction, (5 - 1.25) / 10, 1e-6);
  EXPECT_NEAR(flat->normal.y, 1, 1e-6);
  EXPECT_NEAR(flat->point.y, 1, 1e-6);
  const auto edge = SweepAt(*floor, box, {{0, 5, 0}, {0, -10, 0}}, AboutZ(0.5));
  ASSERT_TRUE(edge.has_value());
  const double down = 0.5 * std::sin(0.5) + 0.25 * std::cos(0.5);
  EXPECT_NEAR(edge->fraction, (5 - 1 - down) / 10, 1e-6);
  const auto past = SweepAt(*floor, box, {{10.51, 5, 0}, {0, -10, 0}});
  EXPECT_FALSE(past.has_value());
}

TEST(SweepOfAShapeTest, ACapsuleLandsOnAPlaneByItsCap) {
  const auto plane = GeometryOf(PlaneShape{{0, 1, 0}, 0});
  const CapsuleShape capsule{0.3, 0.5};
  const auto upright = SweepAt(*plane, capsule, {{3, 4, 0}, {0, -8, 0}});
  ASSERT_TRUE(upright.has_value());
  EXPECT_NEAR(upright->fraction, (4 - 0.8) / 8, 1e-7);
  EXPECT_NEAR(upright->point.y, 0, 1e-7);
  EXPECT_NEAR(upright->point.x, 3, 1e-7);
  const auto leaning = SweepAt(*plane, capsule, {{3, 4, 0}, {0, -8, 0}}, AboutZ(1.0));
  ASSERT_TRUE(leaning.has_value());
  EXPECT_NEAR(leaning->fraction, (4 - 0.3 - 0.5 * std::cos(1.0)) / 8, 1e-7);
  const auto below = SweepAt(*plane, capsule, {{3, 0.5, 0}, {0, 8, 0}});
  ASSERT_TRUE(below.has_value());
  EXPECT_EQ(below->fraction, 0);
}

// A plane that rises by one in two along x, as a field of height samples and as a mesh.
TEST(SweepOfAShapeTest, ABallComesToLieOnASlopeOfTriangles) {
  HeightFieldShape field{.columns = 41, .rows = 41, .spacing_m = 0.5, .heights_m = {}};
  TriangleMeshShape mesh;
  for (std::uint32_t z = 0; z < 41; ++z) {
    for (std::uint32_t x = 0; x < 41; ++x) {
      const float height = 0.25f * (static_cast<float>(x) - 20);
      field.heights_m.push_back(height);
      mesh.vertices.push_back({0.5f * (static_cast<float>(x) - 20), height, 0.5f * (static_cast<float>(z) - 20)});
      const std::uint32_t a = z * 41 + x, below = a + 41;
      if (x == 40 || z == 40) continue;
      mesh.triangles.push_back({a, below, a + 1});
      mesh.triangles.push_back({a + 1, below, below + 1});
    }
  }
  const double lift = 0.3 * std::sqrt(1.25);  // height of a ball's middle above the slope
  for (const auto& slope : {GeometryOf(field), GeometryOf(mesh)}) {
    const auto down = SweepAt(*slope, SphereShape{0.3}, {{1.3, 8, -2.2}, {0, -10, 0}});
    ASSERT_TRUE(down.has_value());
    EXPECT_NEAR(down->fraction, (8 - 0.65 - lift) / 10, 1e-6);
    EXPECT_NEAR(down->normal.x, -1 / std::sqrt(5.0), 1e-5);
    EXPECT_NEAR(down->normal.y, 2 / std::sqrt(5.0), 1e-5);
    const auto across = SweepAt(*slope, SphereShape{0.3}, {{-9.9, 3, 0.1}, {19, 0, 0}});
    ASSERT_TRUE(across.has_value());
    EXPECT_NEAR(across->point.y, 3 - 0.3 * 2 / std::sqrt(5.0), 1e-4);
    EXPECT_NEAR(-9.9 + 19 * across->fraction, 2 * (3 - lift), 1e-5);
    EXPECT_FALSE(SweepAt(*slope, SphereShape{0.3}, {{-9.9, 6, 0}, {19, 0, 0}}).has_value());
    const auto in_it = SweepAt(*slope, SphereShape{0.3}, {{0, 0.1, 0}, {0, 5, 0}});
    ASSERT_TRUE(in_it.has_value());
    EXPECT_EQ(in_it->fraction, 0);
  }
}

// Distance of a point from a triangle, by a fine grid of the triangle's points.
double GridDistance(const std::array<Vec3d, 3>& c, Vec3d p) {
  constexpr int kParts = 150;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kParts; ++i) {
    for (int k = 0; i + k <= kParts; ++k) {
      const Vec3d on = c[0] + (c[1] - c[0]) * (i / double{kParts}) + (c[2] - c[0]) * (k / double{kParts});
      least = std::min(least, Length(on - p));
    }
  }
  return least;
}

TEST(SweepOfAShapeTest, ABallTouchesATriangleWhereItsDistanceIsItsRadius) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> one(-1, 1);
  int hits = 0;
  for (int i = 0; i < 60; ++i) {
    TriangleMeshShape mesh;
    std::array<Vec3d, 3> corners;
    for (Vec3d& corner : corners) {
      mesh.vertices.push_back(Vec3f(Vec3d{one(random), one(random), one(random)}));
      corner = Vec3d(mesh.vertices.back());
    }
    mesh.triangles = {{0, 1, 2}};
    const LocalRay ray{{-4, one(random), one(random)}, {8, one(random), one(random)}};
    const auto hit = SweepAt(*GeometryOf(mesh), SphereShape{0.3}, ray);
    double nearest = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= 100; ++k) {
      // Before the hit it is further away everywhere.
      nearest = std::min(nearest, GridDistance(corners, ray.At((hit ? hit->fraction : 1) * k / 100)));
    }
    EXPECT_GT(nearest, 0.3 - 1e-4);
    if (!hit) continue;
    ++hits;
    const double distance = GridDistance(corners, ray.At(hit->fraction));
    EXPECT_NEAR(distance, 0.3, 2e-3) << "by the width of the grid";
    EXPECT_NEAR(Length(ray.At(hit->fraction) - hit->point), 0.3, 1e-5);
  }
  EXPECT_GT(hits, 15);
}

// The least distance along the way, by small steps: a sweep meets what comes nearer than nothing, and there first.
TEST(SweepOfAShapeTest, AgreesWithSmallStepsForEveryPairOfShapes) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> one(-1, 1);
  const QueryShape probes[] = {SphereShape{0.2}, CapsuleShape{0.2, 0.4}, BoxShape{{0.3, 0.1, 0.2}}};
  for (const auto& target : ConvexShapes()) {
    for (const QueryShape& shape : probes) {
      for (int i = 0; i < 40; ++i) {
        const Quatd turned = Normalized(Quatd{one(random), one(random), one(random), one(random)});
        const LocalRay ray{{-3, one(random), one(random)}, {6, one(random), one(random)}};
        Probe::Turned probe = Probe(shape, turned).In({});
        const Core core(AtOrigin(*target), 0);
        const auto distance = [&](double t) {
          probe.core.Place(ray.At(t), probe.axes);
          const GjkResult found = Gjk(core, probe.core, {1, 0, 0}, std::numeric_limits<double>::infinity());
          const bool apart = found.kind == GjkResult::Kind::kApart;
          return (apart ? found.distance_m : 0) - core.radius() - probe.core.radius();
        };
        double least = 1, first = 2;
        for (int k = 0; k <= 600; ++k) {
          const double now = distance(k / 600.0);
          if (now <= 1e-7 && first > 1) first = k / 600.0;
          least = std::min(least, now);
        }
        const auto hit = SweepAt(*target, shape, ray, turned);
        if (least > 1e-3) {
          EXPECT_FALSE(hit.has_value()) << static_cast<int>(target->kind);
        }
        if (least > 0) continue;
        ASSERT_TRUE(hit.has_value()) << static_cast<int>(target->kind);
        EXPECT_LE(hit->fraction, first + 1e-6);
        EXPECT_GE(hit->fraction, first - 1 / 600.0 - 1e-6);
        EXPECT_NEAR(distance(hit->fraction), 0, 1e-5);
        EXPECT_LT(Dot(hit->normal, ray.along), 0);
      }
    }
  }
}

}  // namespace
}  // namespace tessera::physics
