#include "core/physics/mass_properties.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/physics/testing/bodies.h"
#include "core/physics/testing/turns.h"

namespace tessera::physics {
namespace {

void ExpectNear(Vec3d actual, Vec3d expected, double tolerance) {
  EXPECT_NEAR(actual.x, expected.x, tolerance);
  EXPECT_NEAR(actual.y, expected.y, tolerance);
  EXPECT_NEAR(actual.z, expected.z, tolerance);
}

// Inertia tensor of the principal moments and axes, times v.
Vec3d Apply(const MassProperties& m, Vec3d v) {
  const Vec3d local = Rotate(Conjugate(m.axes), v);
  return Rotate(m.axes, {m.principal.x * local.x, m.principal.y * local.y, m.principal.z * local.z});
}

// Shares of a shape's volume and second moments, by throwing points into a box around it.
struct Sampled {
  double volume = 0;
  Vec3d center, diagonal;
};
template <class Inside>
Sampled Sample(Vec3d half, Inside inside) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Vec3d first, second;
  constexpr int kPoints = 2'000'000;
  int hits = 0;
  for (int i = 0; i < kPoints; ++i) {
    const Vec3d p{half.x * uniform(random), half.y * uniform(random), half.z * uniform(random)};
    if (!inside(p)) continue;
    ++hits;
    first += p;
    second += {p.x * p.x, p.y * p.y, p.z * p.z};
  }
  const Vec3d c = first / hits;
  const Vec3d v = second / hits - Vec3d{c.x * c.x, c.y * c.y, c.z * c.z};
  return {8 * half.x * half.y * half.z * hits / kPoints, c, {v.y + v.z, v.x + v.z, v.x + v.y}};
}

// Within the noise of the sampling: three digits.
void ExpectMatches(const Shape& shape, const Sampled& sampled) {
  const MassProperties m = MassPropertiesOf(shape);
  EXPECT_NEAR(m.volume_m3, sampled.volume, 4e-3 * sampled.volume);
  ExpectNear(m.center_of_mass, sampled.center, 4e-3);
  ExpectNear(m.principal, sampled.diagonal, 4e-3 * Length(sampled.diagonal));
}

TEST(MassPropertiesTest, PrimitivesMatchTheIntegralOverTheirVolume) {
  ExpectMatches({BoxShape{{0.5, 1, 1.5}}}, Sample({0.5, 1, 1.5}, [](Vec3d) { return true; }));
  ExpectMatches({SphereShape{0.7}}, Sample({0.7, 0.7, 0.7}, [](Vec3d p) { return Length(p) <= 0.7; }));
  ExpectMatches({CylinderShape{0.5, 1}}, Sample({0.5, 1, 0.5}, [](Vec3d p) { return std::hypot(p.x, p.z) <= 0.5; }));
  ExpectMatches({CapsuleShape{0.5, 1}}, Sample({0.5, 1.5, 0.5}, [](Vec3d p) {
                  return Length(Vec3d{p.x, std::max(std::abs(p.y) - 1, 0.0), p.z}) <= 0.5;
                }));
  ExpectMatches({ConeShape{0.8, 2}},
                Sample({0.8, 1, 0.8}, [](Vec3d p) { return std::hypot(p.x, p.z) <= 0.8 * (1 - p.y) / 2; }));
}

TEST(MassPropertiesTest, TextbookValues) {
  ExpectNear(MassPropertiesOf({BoxShape{{0.05, 0.2, 0.45}}}).principal * 10, {0.808333, 0.683333, 0.141667}, 1e-6);
  ExpectNear(MassPropertiesOf({SphereShape{2}}).principal, {1.6, 1.6, 1.6}, 1e-12);
  ExpectNear(MassPropertiesOf({ConeShape{1, 4}}).center_of_mass, {0, -1, 0}, 1e-12);
}

ConvexHullShape BoxHull(Vec3d half, Vec3d center) {
  ConvexHullShape hull;
  for (int i = 0; i < 8; ++i) {
    const Vec3d corner{i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z};
    hull.points.push_back(Vec3f(corner + center));
  }
  return hull;
}

TEST(MassPropertiesTest, HullOfABoxIsTheBoxWhereverItsPointsLie) {
  const Vec3d half{0.5, 1, 1.5}, center{10, -3, 2};
  const MassProperties hull = MassPropertiesOf({BoxHull(half, center)}), box = MassPropertiesOf({BoxShape{half}});
  EXPECT_NEAR(hull.volume_m3, box.volume_m3, 1e-5);
  ExpectNear(hull.center_of_mass, center, 1e-5);
  ExpectNear(hull.principal, box.principal, 1e-5);
  EXPECT_EQ(hull.axes, Quatd());
}

// The corner of a cube: volume 1/6, centre 1/4, and by integration the moments 3/80 and products of inertia 1/80 of 1
// kg.
TEST(MassPropertiesTest, TetrahedronHasItsClosedForm) {
  const MassProperties m = MassPropertiesOf({ConvexHullShape{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}});
  EXPECT_NEAR(m.volume_m3, 1.0 / 6, 1e-7);
  ExpectNear(m.center_of_mass, {0.25, 0.25, 0.25}, 1e-7);
  ExpectNear(Apply(m, {1, 0, 0}), {6.0 / 80, 1.0 / 80, 1.0 / 80}, 1e-7);
  ExpectNear(Apply(m, {0, 1, 0}), {1.0 / 80, 6.0 / 80, 1.0 / 80}, 1e-7);
}

TEST(MassPropertiesTest, CompoundOfTwoHalvesIsTheWhole) {
  const CompoundShape halves{{{{{-0.25, 0, 0}, {}}, Box(0.25, 1, 1.5)}, {{{0.25, 0, 0}, {}}, Box(0.25, 1, 1.5)}}};
  const MassProperties compound = MassPropertiesOf({halves}), box = MassPropertiesOf({BoxShape{{0.5, 1, 1.5}}});
  EXPECT_NEAR(compound.volume_m3, box.volume_m3, 1e-12);
  ExpectNear(compound.principal, box.principal, 1e-12);
}

TEST(MassPropertiesTest, CompoundWeighsItsPartsByVolume) {
  const CompoundShape compound{{{{{0, 0, 0}, {}}, Cube(0.5)}, {{{3, 0, 0}, {}}, Cube(1)}}};
  ExpectNear(MassPropertiesOf({compound}).center_of_mass, {3.0 * 8 / 9, 0, 0}, 1e-12);
}

TEST(MassPropertiesTest, TurnedPartTurnsItsAxes) {
  const Quatd turn = About({1, 2, 3}, 0.9);
  const CompoundShape compound{{{{{1, 2, 3}, turn}, Box(0.5, 1, 1.5)}}};
  const MassProperties m = MassPropertiesOf({compound}), box = MassPropertiesOf({BoxShape{{0.5, 1, 1.5}}});
  for (const Vec3d axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
    ExpectNear(Apply(m, axis), Rotate(turn, Apply(box, Rotate(Conjugate(turn), axis))), 1e-12);
  }
}

TEST(CenterOfMassTest, IsTheShapesOriginForAStaticBody) {
  ExpectNear(CenterOfMass(Dynamic(1, MakeShapePtr(ConeShape{1, 4}), {})), {0, -1, 0}, 1e-12);
  EXPECT_EQ(CenterOfMass(Static(1, MakeShapePtr(ConeShape{1, 4}))), Vec3d());
}

}  // namespace
}  // namespace tessera::physics
