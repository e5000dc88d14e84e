// Boxes and hulls against each other, against all axes and all features tried one by one.
#include <gmock/gmock.h>

#include "core/physics/collide/primary_pairs.h"
#include "core/physics/collide/testing/brute_force.h"
#include "core/physics/collide/testing/shapes.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

using ShapeRef = std::shared_ptr<const Geometry>;

// Two boxes that meet in a strip as thin as rounding.
bool Grazing(const Solid& p, const Solid& q) {
  if (p.shape->faces.size() != 6 || q.shape->faces.size() != 6) return false;
  int thin = 0;
  for (const Solid* owner : {&p, &q})
    for (std::size_t i = 0; i < 6; i += 2) {
      const Vec3d axis = owner->Turned(owner->shape->faces[i].normal);
      thin += std::abs(std::max(Gap(p, q, axis), Gap(p, q, -axis))) < kGraze_m;
    }
  return thin > 0;
}

// The manifold against what is true of the pair.
void Check(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m, const LocalManifold& m) {
  const Solid p = SolidOf(a), q = SolidOf(b, pose);
  const double gap = LargestGap(p, q), size = std::min(a.outer_radius_m, b.outer_radius_m);
  constexpr double kRounding = 2e-6;
  if (m.count == 0) {
    if (Grazing(p, q)) return;
    EXPECT_GT(gap > 0 ? DistanceOf(p, q) : gap, speculative_m - 2e-5) << "gap " << gap;
    return;
  }
  const double lead = std::min<double>(kEdgeLead_m, kEdgeLeadShare * size) + kKeepFace_m;
  // Never deeper than the shallowest way out, but for what faces are favoured by; never further than they are.
  EXPECT_GE(Nearest(m), gap - lead - kRounding);
  EXPECT_LE(Nearest(m), (gap > 0 ? DistanceOf(p, q) : gap) + lead + kRounding);
  EXPECT_NEAR(Length(m.normal), 1, 1e-5);
  for (int i = 0; i < m.count; ++i) {
    const LocalPoint& point = m.points[static_cast<std::size_t>(i)];
    EXPECT_LE(point.separation_m, speculative_m);
    EXPECT_LE(Length(point.on_b - point.on_a - m.normal * point.separation_m), 5e-6);
    const double slack = 3e-4 * size + 1e-5;
    EXPECT_LE(DistanceToSurface(Vec3d(point.on_a), p), slack);
    EXPECT_LE(DistanceToSurface(Vec3d(point.on_b), q), slack);
    for (int j = 0; j < i; ++j) EXPECT_NE(point.feature, m.points[static_cast<std::size_t>(j)].feature);
  }
}

// Places b about `gap` from a along a random direction.
LocalPose Beside(Draw& draw, const Geometry& a, const Geometry& b, Quatd turn, double gap) {
  const Vec3d direction = draw.In(0, 1) < 0.2 ? Vec3d{0, 1, 0} : draw.Direction();
  const Solid p = SolidOf(a);
  Solid q{b.polyhedron.get(), {}, RotationOf(turn)};
  Vec3d along = direction * (p.Most(direction) + q.Most(-direction) + gap);
  // Sideways too, so that not only middles meet.
  Vec3d aside = Cross(direction, draw.Direction()) * draw.In(0, 0.7);
  return LocalOf({along + aside, turn});
}

void CheckMany(const std::vector<ShapeRef>& shapes, std::uint32_t seed, int rounds) {
  Draw draw(seed);
  int touching = 0;
  for (int i = 0; i < rounds && !testing::Test::HasFailure(); ++i) {
    const Geometry &a = *shapes[draw.Index(shapes.size())], &b = *shapes[draw.Index(shapes.size())];
    const LocalPose pose = Beside(draw, a, b, draw.OftenAligned(), draw.In(-0.2, 0.03));
    ConvexCache cache;
    LocalManifold m;
    CollideConvex(a, b, pose, 0.02f, cache, &m);
    SCOPED_TRACE(testing::Message() << "round " << i);
    Check(a, b, pose, 0.02f, m);
    touching += m.count > 0;
    // The same again knows the axis already.
    LocalManifold again;
    CollideConvex(a, b, pose, 0.02f, cache, &again);
    EXPECT_EQ(again.count > 0, m.count > 0);
    if (again.count > 0) Check(a, b, pose, 0.02f, again);
  }
  EXPECT_GT(touching, rounds / 4);
}

TEST(BoxPairTest, TellsTheShallowestWayOutWithPointsOnBothSurfaces) {
  CheckMany({GeometryOf(BoxShape{{0.5, 0.5, 0.5}}), GeometryOf(BoxShape{{0.5, 0.3, 0.7}}),
             GeometryOf(BoxShape{{0.05, 0.6, 0.3}})},
            1, 6000);
}

TEST(HullPairTest, TellsTheShallowestWayOutWithPointsOnBothSurfaces) {
  Draw draw(5);
  CheckMany({GeometryOf(CubeHull({0.2f, 0.1f, -0.1f}, 0.4f)), GeometryOf(PrismHull(5, 0.5f, 0.4f)),
             GeometryOf(BoxShape{{0.5, 0.3, 0.7}}), GeometryOf(RandomHull(draw, 6)), GeometryOf(RandomHull(draw, 12))},
            2, 3000);
}

TEST(BoxPairTest, HoldsFlushCubesAtFourCornersAtOnce) {
  const ShapeRef cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  for (const double gap : {-0.01, 0.0, 0.01}) {
    ConvexCache cache;
    LocalManifold m;
    CollideConvex(*cube, *cube, LocalOf({{0, 1 + gap, 0}, {}}), 0.02f, cache, &m);
    ASSERT_EQ(m.count, 4);
    EXPECT_EQ(m.normal, (Vec3f{0, 1, 0}));
    Vec3f sum;
    for (const LocalPoint& point : m.points) {
      EXPECT_NEAR(point.separation_m, gap, 1e-6);
      EXPECT_NEAR(std::abs(point.on_a.x), 0.5, 1e-6);
      EXPECT_NEAR(std::abs(point.on_a.z), 0.5, 1e-6);
      sum += point.on_a;
    }
    EXPECT_NEAR(Length(sum), 2, 1e-5);  // one at each corner
  }
}

TEST(BoxPairTest, AgreesWithTheSameBoxesAsHulls) {
  Draw draw(3);
  const ShapeRef box = GeometryOf(BoxShape{{0.4, 0.4, 0.4}}), other = GeometryOf(BoxShape{{0.5, 0.3, 0.7}});
  const ShapeRef hull = GeometryOf(CubeHull({}, 0.4f));
  for (int i = 0; i < 2000; ++i) {
    const LocalPose pose = Beside(draw, *other, *box, draw.OftenAligned(), draw.In(-0.1, 0.03));
    ConvexCache first, second;
    LocalManifold boxes, hulls;
    CollideConvex(*other, *box, pose, 0.02f, first, &boxes);
    CollideConvex(*other, *hull, pose, 0.02f, second, &hulls);
    ASSERT_EQ(boxes.count > 0, hulls.count > 0) << i;
    if (boxes.count > 0) {
      ASSERT_NEAR(Nearest(boxes), Nearest(hulls), 2e-3) << i;
    }
  }
}

TEST(BoxPairTest, KeepsItsFaceWhileRoundingTiltsIt) {
  const ShapeRef cube = GeometryOf(BoxShape{{0.5, 0.5, 0.5}});
  Draw draw(4);
  ConvexCache cache;
  LocalManifold m;
  CollideConvex(*cube, *cube, LocalOf({{0.1, 0.9995, 0.2}, {}}), 0.02f, cache, &m);
  const std::uint32_t face = cache.feature;
  for (int i = 0; i < 1000; ++i) {
    const Vec3d trembles = draw.Direction() * 1e-4;
    CollideConvex(*cube, *cube, LocalOf({Vec3d{0.1, 0.9995, 0.2} + trembles, About(draw.Direction(), 1e-4)}), 0.02f,
                  cache, &m);
    ASSERT_EQ(cache.feature, face);
    ASSERT_EQ(m.count, 4);
  }
}

TEST(BoxPairTest, LetsAllButRoundThingsSlideFromOneBoxToTheNextFlushWithIt) {
  const ShapeRef tile = GeometryOf(BoxShape{{1, 0.25, 1}}), cube = GeometryOf(BoxShape{{0.3, 0.3, 0.3}});
  for (const ShapeRef& slider : {cube, GeometryOf(CubeHull({}, 0.3f)), GeometryOf(CylinderShape{0.3, 0.3})}) {
    for (const double sunk : {-0.0005, 0.0, 0.0005, 0.0015, 0.004}) {
      for (const double angle : {0.0, 0.4}) {
        for (double x = -2; x < 2; x += 0.0017) {
          ConvexCache cache;
          LocalManifold m;
          CollideConvex(*tile, *slider, LocalOf({{x, 0.55 - sunk, 0.1}, About({0, 1, 0}, angle)}), 0.02f, cache, &m);
          if (m.count > 0) {
            ASSERT_GT(m.normal.y, 0.999) << "at " << x << ", sunk by " << sunk;
          }
          if (std::abs(x) < 1) {
            ASSERT_GT(m.count, 0) << "at " << x << ", sunk by " << sunk;
          }
        }
      }
    }
  }
  // A kerb stops it.
  ConvexCache cache;
  LocalManifold m;
  CollideConvex(*tile, *cube, LocalOf({{-1.305, 0.54, 0.1}, {}}), 0.02f, cache, &m);
  ASSERT_EQ(m.count, 4);
  EXPECT_EQ(m.normal, (Vec3f{-1, 0, 0}));
}

TEST(BoxPairTest, CrossesEdgesAtOnePoint) {
  const ShapeRef beam = GeometryOf(BoxShape{{0.5, 0.5, 3}}), across = GeometryOf(BoxShape{{3, 0.5, 0.5}});
  const double edge = 0.5 * std::sqrt(2.0), quarter = std::acos(-1.0) / 4;
  ConvexCache cache;
  LocalManifold m;
  // The upper beam's lower edge runs along x over the lower beam's upper edge along z.
  const Quatd tilt = About({0, 0, 1}, quarter);
  const Quatd turn = Conjugate(tilt) * About({1, 0, 0}, quarter);
  CollideConvex(*beam, *across, LocalOf({Rotate(Conjugate(tilt), Vec3d{0, 2 * edge + 0.003, 0}), turn}), 0.02f, cache,
                &m);
  ASSERT_EQ(m.count, 1);
  EXPECT_NEAR(m.points[0].separation_m, 0.003, 1e-6);
  EXPECT_NEAR(Dot(m.normal, Vec3f(Rotate(Conjugate(tilt), Vec3d{0, 1, 0}))), 1, 1e-6);
  EXPECT_LE(Length(m.points[0].on_a - Vec3f{0.5f, 0.5f, 0}), 1e-5f);
}

TEST(HullTest, HasTheFacesOfACubeWhateverLiesInsideOfIt) {
  ConvexHullShape cube = CubeHull({1, 2, 3}, 0.5f);
  cube.points.push_back({1, 2, 3});
  cube.points.push_back({1, 2.5f, 3});         // in a face
  cube.points.push_back({1.5f, 2.5f, 3.25f});  // in an edge
  const auto hull = GeometryOf(cube)->polyhedron;
  EXPECT_EQ(hull->vertices.size(), 8u);
  EXPECT_EQ(hull->faces.size(), 6u);
  EXPECT_EQ(hull->edges.size(), 12u);
  for (const Polyhedron::Face& face : hull->faces) EXPECT_EQ(face.count, 4u);
}

void ExpectSound(const Polyhedron& hull, double size) {
  EXPECT_EQ(hull.vertices.size() + hull.faces.size(), hull.edges.size() + 2);  // Euler
  for (const Polyhedron::Face& face : hull.faces) {
    EXPECT_NEAR(Length(face.normal), 1, 1e-6);
    EXPECT_LT(Dot(face.normal, hull.inside), face.offset_m);
    for (const Vec3f v : hull.vertices) EXPECT_LE(Dot(face.normal, v), face.offset_m + 5e-5 * size);
    for (std::uint32_t k = 0; k < face.count; ++k) {
      const Vec3f u = hull.vertices[hull.loops[face.first + k]];
      const Vec3f v = hull.vertices[hull.loops[face.first + (k + 1) % face.count]];
      EXPECT_NEAR(Dot(face.normal, u), face.offset_m, 5e-5 * size);
      const Vec3f w = hull.vertices[hull.loops[face.first + (k + 2) % face.count]];
      EXPECT_GT(Dot(face.normal, Cross(v - u, w - v)), 0);
    }
  }
  for (const Polyhedron::Edge& edge : hull.edges) {
    const Vec3f across = Cross(hull.faces[edge.left].normal, hull.faces[edge.right].normal);
    EXPECT_GT(Dot(across, hull.vertices[edge.b] - hull.vertices[edge.a]), 0);
  }
}

TEST(HullTest, HoldsEveryPointOfARandomCloud) {
  Draw draw(6);
  for (int i = 0; i < 60; ++i) {
    ConvexHullShape cloud;
    const Vec3d stretch{draw.In(0.05, 3), draw.In(0.05, 3), draw.In(0.05, 3)};
    const Quatd turn = draw.Turn();
    for (std::uint32_t n = 4 + draw.Index(200); n > 0; --n) {
      const Vec3d p = draw.Direction() * draw.In(0.5, 1);
      cloud.points.push_back(Vec3f(Rotate(turn, Vec3d{p.x * stretch.x, p.y * stretch.y, p.z * stretch.z})));
    }
    const auto hull = GeometryOf(cloud)->polyhedron;
    ExpectSound(*hull, 6);
    for (const Vec3f& p : cloud.points)
      for (const Polyhedron::Face& face : hull->faces) EXPECT_LE(Dot(face.normal, p), face.offset_m + 3e-4f);
  }
}

TEST(HullTest, MergesTheFacesOfATurnedGridOfPoints) {
  Draw draw(7);
  for (int i = 0; i < 20; ++i) {
    const Quatd turn = draw.Turn();
    ConvexHullShape grid;
    for (int x = 0; x < 4; ++x)
      for (int y = 0; y < 4; ++y)
        for (int z = 0; z < 4; ++z) grid.points.push_back(Vec3f(Rotate(turn, Vec3d{x * 1.0, y * 0.5, z * 0.3})));
    const auto hull = GeometryOf(grid)->polyhedron;
    EXPECT_EQ(hull->vertices.size(), 8u);
    EXPECT_EQ(hull->faces.size(), 6u);
    EXPECT_EQ(hull->edges.size(), 12u);
    ExpectSound(*hull, 4);
  }
}

TEST(HullTest, BoxesKnowTheirEdges) {
  const auto box = GeometryOf(BoxShape{{0.5, 0.3, 0.7}})->polyhedron;
  EXPECT_EQ(box->edges.size(), 12u);
  ExpectSound(*box, 1);
}

}  // namespace
}  // namespace tessera::physics
