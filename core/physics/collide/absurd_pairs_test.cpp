// Whatever a scene may ask for: extents from a millimetre to 100 km, wherever they are put.
#include <gmock/gmock.h>

#include <limits>

#include "core/physics/collide/collide.h"
#include "core/physics/collide/testing/shapes.h"

namespace tessera::physics {
namespace {

using ShapeRef = std::shared_ptr<const Geometry>;

// Log-uniform from a millimetre to `most`.
double Extent(Draw& draw, double most) { return 1e-3 * std::pow(most / 1e-3, draw.In(0, 1)); }

ShapeRef AnyConvex(Draw& draw, double most) {
  const auto extent = [&] { return Extent(draw, most); };
  switch (draw.Index(6)) {
    case 0:
      return GeometryOf(BoxShape{{extent(), extent(), extent()}});
    case 1:
      return GeometryOf(SphereShape{extent()});
    case 2:
      return GeometryOf(CapsuleShape{extent(), extent()});
    case 3:
      return GeometryOf(CylinderShape{extent(), extent()});
    case 4:
      return GeometryOf(ConeShape{extent(), extent()});
    default: {
      ConvexHullShape hull;
      const Vec3d stretch{extent(), extent(), extent()};
      for (std::uint32_t n = 6 + draw.Index(40); n > 0; --n) {
        const Vec3d p = draw.Direction();
        hull.points.push_back(Vec3f(Vec3d{p.x * stretch.x, p.y * stretch.y, p.z * stretch.z}));
      }
      return GeometryOf(hull);
    }
  }
}

ShapeRef AnyStatic(Draw& draw) {
  const double e = Extent(draw, 1e4);
  switch (draw.Index(4)) {
    case 0:
      return GeometryOf(PlaneShape{draw.Direction(), draw.In(-1, 1) * e});
    case 1: {
      const auto f = static_cast<float>(e);
      return GeometryOf(TriangleMeshShape{{{-f, 0, -f}, {-f, 0.1f * f, f}, {f, 0, f}, {f, 0, -f}, {f, 0, -f}},
                                          {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}});
    }
    case 2:
      return GeometryOf(HeightFieldShape{3, 3, e, {0, 0.2f, 0, 0.1f, 0.3f, 0, 0, 0.1f, 0.2f}});
    default: {
      CompoundShape parts;
      for (int i = 0; i < 3; ++i)
        parts.children.push_back({{draw.Direction() * e, draw.Turn()},
                                  std::make_shared<const Shape>(Shape{BoxShape{{e, 0.1 * e + 1e-3, 0.5 * e + 1e-3}}})});
      return GeometryOf(parts);
    }
  }
}

void ExpectSane(const Manifolds& manifolds) {
  for (const Manifold& m : manifolds) {
    ASSERT_GE(m.count, 1);
    ASSERT_LE(m.count, kManifoldPoints);
    EXPECT_NEAR(Length(m.normal), 1, 1e-4);
    for (int i = 0; i < m.count; ++i) {
      const ManifoldPoint& point = m.points[static_cast<std::size_t>(i)];
      EXPECT_TRUE(IsFinite(point.r_a) && IsFinite(point.r_b) && std::isfinite(point.separation_m));
      EXPECT_LE(point.separation_m, 0.02f);
    }
  }
}

void Put(Draw& draw, const ShapeRef& a, const ShapeRef& b) {
  const double reach = std::isfinite(b->outer_radius_m) ? a->outer_radius_m + b->outer_radius_m : a->outer_radius_m;
  const auto about = [&](double away) -> Placement {
    const Quatd turn = draw.OftenAligned();
    return {draw.Direction() * away, turn, RotationOf(turn)};
  };
  const double far[] = {0, 0, 0.01, 0.3, 0.7, 1};
  const Placement at_a = about(reach * far[draw.Index(6)]), at_b = about(0);
  PairCache cache, mirrored;
  Manifolds one, two;
  for (int i = 0; i < 2; ++i) {
    Collide({*a, at_a}, {*b, at_b}, 0.02f, cache, one);
    Collide({*b, at_b}, {*a, at_a}, 0.02f, mirrored, two);
    ExpectSane(one);
    ExpectSane(two);
  }
}

TEST(AbsurdPairsTest, ConvexShapesOfAnySizeGiveFinitePoints) {
  Draw draw(21);
  for (int i = 0; i < 4000 && !testing::Test::HasFailure(); ++i) {
    const double most = i % 2 ? 1e5 : 2;
    const ShapeRef a = AnyConvex(draw, most), b = AnyConvex(draw, most);
    SCOPED_TRACE(testing::Message() << "round " << i);
    Put(draw, a, b);
  }
}

TEST(AbsurdPairsTest, StaticShapesOfAnySizeGiveFinitePoints) {
  Draw draw(22);
  for (int i = 0; i < 1500 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(testing::Message() << "round " << i);
    Put(draw, AnyConvex(draw, i % 2 ? 1e4 : 2), AnyStatic(draw));
  }
}

// The world takes out who is not finite; should one come through, it must do no more than make nonsense.
TEST(AbsurdPairsTest, PlacesThatAreNotFiniteReadNothingOutOfBounds) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  const double bad[] = {kNan, kInf, -kInf, 1e300, 1e30, 1e18};
  Draw draw(23);
  for (int i = 0; i < 1000; ++i) {
    const ShapeRef a = AnyConvex(draw, 2), b = i % 3 != 0 ? AnyConvex(draw, 2) : AnyStatic(draw);
    const double value = bad[draw.Index(6)];
    Quatd turn = draw.Turn();
    Vec3d at = draw.Direction();
    (i % 2 != 0 ? turn.x : at.x) = value;
    const Placement at_a{at, turn, RotationOf(turn)}, at_b;
    PairCache cache, mirrored;
    Manifolds manifolds;
    for (int k = 0; k < 2; ++k) {
      Collide({*a, at_a}, {*b, at_b}, 0.02f, cache, manifolds);
      Collide({*b, at_b}, {*a, at_a}, 0.02f, mirrored, manifolds);
      for (const Manifold& m : manifolds) ASSERT_LE(m.count, kManifoldPoints);
    }
  }
}

}  // namespace
}  // namespace tessera::physics
