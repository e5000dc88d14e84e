// Sweeps against closed forms and against brute force: every shape, fast, spinning, grazing, far from the origin.

#include "core/physics/motion/sweep.h"

#include <gmock/gmock.h>

#include <numbers>
#include <optional>
#include <random>

#include "core/physics/collide/gjk.h"
#include "core/physics/trig.h"

namespace tessera::physics {
namespace {

constexpr float kTarget_m = 0.0005f;
using GeometryPtr = std::shared_ptr<const Geometry>;

template <class Form>
GeometryPtr Make(Form form) {
  return MakeGeometry(Shape{std::move(form)}, {});
}
ShapePtr Box(double x, double y, double z) { return std::make_shared<const Shape>(Shape{BoxShape{{x, y, z}}}); }

SweptMotion Still(const GeometryPtr& geometry, Vec3d at = {}, Quatd q = {}) { return {*geometry, at, at, q, {}}; }
SweptMotion Straight(const GeometryPtr& geometry, Vec3d from, Vec3d to, Quatd q = {}) {
  return {*geometry, from, to, q, {}};
}
SweptMotion Turning(const GeometryPtr& geometry, Vec3d from, Vec3d to, Quatd q, Vec3d turn) {
  return {*geometry, from, to, q, turn};
}

Quatd OrientationAt(const SweptMotion& motion, double t) { return TurnBy(motion.turned_rad * t) * motion.orientation; }
// Distance of two convex shapes at one moment, by GJK.
double DistanceAt(const SweptMotion& a, const SweptMotion& b, double t) {
  const auto placed = [t](const SweptMotion& motion, Vec3d origin) {
    Core core(AtOrigin(motion.geometry), 0);
    const Quatd q = OrientationAt(motion, t);
    core.Place(motion.from + (motion.to - motion.from) * t - origin,
               {Rotate(q, Vec3d{1, 0, 0}), Rotate(q, Vec3d{0, 1, 0}), Rotate(q, Vec3d{0, 0, 1})});
    return core;
  };
  const Core core_a = placed(a, a.from), core_b = placed(b, a.from);
  const GjkResult found = Gjk(core_a, core_b, {1, 0, 0}, 1e9);
  return found.distance_m - core_a.radius() - core_b.radius();
}

TEST(SweepTest, BallMeetsBallWhereTheQuadraticSays) {
  const GeometryPtr a = Make(SphereShape{0.3}), b = Make(SphereShape{0.2});
  for (const double offset : {0.0, 0.1, 0.3, 0.45, 0.4995}) {
    const auto impact =
        FirstImpact(Straight(a, {-4, 0, 0}, {4, 0, 0}), Straight(b, {3, offset, 0}, {-5, offset, 0}), kTarget_m);
    ASSERT_TRUE(impact) << offset;
    const double touch = 0.5 + kTarget_m;
    EXPECT_NEAR(impact->fraction, (7 - std::sqrt(touch * touch - offset * offset)) / 16, 1e-4) << offset;
    EXPECT_NEAR(impact->normal.y, offset / touch, 1e-2);
  }
}

// A compound of one ball is swept as any two shapes are, a ball by itself in closed form.
TEST(SweepTest, BallsMeetWhereAnyTwoShapesOfTheirKindWould) {
  const auto whole = [](const GeometryPtr& shape) {
    return Make(CompoundShape{{{{}, std::make_shared<const Shape>(Shape{SphereShape{shape->radius_m}})}}});
  };
  const GeometryPtr a = Make(SphereShape{0.3}), b = Make(SphereShape{0.2}), plane = Make(PlaneShape{{0, 1, 0}, -0.4});
  const GeometryPtr whole_a = whole(a), whole_b = whole(b);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto somewhere = [&](double size) { return Vec3d{uniform(random), uniform(random), uniform(random)} * size; };
  // A sweep of any two shapes ends within a hundredth of a millimetre of its target.
  const auto same = [](const std::optional<Impact>& found, const std::optional<Impact>& wanted, const auto& distance) {
    ASSERT_EQ(found.has_value(), wanted.has_value());
    if (!found) return;
    ASSERT_NEAR(distance(found->fraction), distance(wanted->fraction), 1.1e-5);
    ASSERT_LT(Length(found->normal - wanted->normal), 1e-2f);
  };
  int met = 0;
  for (int i = 0; i < 3000; ++i) {
    SCOPED_TRACE(i);
    const Vec3d from = somewhere(0.6), to = from + somewhere(2), b_from = somewhere(0.6), b_to = b_from + somewhere(2);
    const SweptMotion one = Straight(a, from, to), other = Straight(b, b_from, b_to);
    const auto wanted = FirstImpact(Straight(whole_a, from, to), Straight(whole_b, b_from, b_to), kTarget_m);
    same(FirstImpact(one, other, kTarget_m), wanted, [&](double t) { return DistanceAt(one, other, t); });
    const auto at_plane = FirstImpact(Still(plane), Straight(whole_b, b_from, b_to), kTarget_m);
    same(FirstImpact(Still(plane), other, kTarget_m), at_plane, [&](double t) { return other.At(t).position.y + 0.2; });
    const auto from_ball = FirstImpact(other, Still(plane), kTarget_m);
    ASSERT_EQ(from_ball.has_value(), at_plane.has_value());
    if (from_ball) {
      ASSERT_LT(Length(from_ball->normal + at_plane->normal), 1e-6f);
    }
    met += wanted.has_value() && at_plane.has_value() ? 1 : 0;
  }
  EXPECT_GT(met, 100);
}

TEST(SweepTest, BallAtBulletSpeedStopsBeforeAWallOfAnyKind) {
  const GeometryPtr ball = Make(SphereShape{0.05});
  const std::vector<GeometryPtr> walls = {
      Make(BoxShape{{5, 5, 0.005}}),
      Make(TriangleMeshShape{{{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}}, {{0, 1, 2}, {0, 2, 3}}}),
      Make(CompoundShape{{{{{0, 2.5, 0}, {}}, Box(5, 2.5, 0.005)}, {{{0, -2.5, 0}, {}}, Box(5, 2.5, 0.005)}}})};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const GeometryPtr& wall : walls) {
    const double face = wall->kind == GeometryKind::kMesh ? 0 : 0.005;
    for (int i = 0; i < 1000; ++i) {
      const Vec3d from{uniform(random), uniform(random), 0.2 + 7.9 * std::abs(uniform(random))};
      const Vec3d to = from + Normalized(Vec3d{uniform(random), uniform(random), -3}) * (500.0 / 60);
      if (to.z > 0 || std::abs(to.x) > 4 || std::abs(to.y) > 4) continue;
      const auto impact = FirstImpact(Still(wall), Straight(ball, from, to), kTarget_m);
      ASSERT_TRUE(impact) << from << to;
      const double expected = (from.z - face - 0.05 - kTarget_m) / (from.z - to.z);
      ASSERT_NEAR(impact->fraction * (from.z - to.z), expected * (from.z - to.z), 1.1e-5);
      ASSERT_NEAR(impact->normal.z, 1, 1e-4);
    }
  }
}

TEST(SweepTest, PlaneAndHeightFieldStopAFallingBox) {
  const GeometryPtr plane = Make(PlaneShape{{0, 1, 0}, 2});
  const BodyFrame centred{.origin = {0, 2, 0}, .axes = {}};
  const GeometryPtr field = MakeGeometry({HeightFieldShape{3, 3, 4, {2, 2, 2, 2, 2, 2, 2, 2, 2}}}, centred);
  const Quatd tilt = TurnBy({0, 0, std::numbers::pi / 4});
  for (const GeometryPtr& ground : {plane, field}) {
    const Vec3d at = ground == plane ? Vec3d() : centred.origin;
    const auto impact = FirstImpact(Straight(Make(BoxShape{{.5, .5, .5}}), {.3, 9, .2}, {.3, -1, .2}, tilt),
                                    Still(ground, at), kTarget_m);
    ASSERT_TRUE(impact);
    EXPECT_NEAR(impact->fraction, (7 - std::sqrt(0.5) - kTarget_m) / 10, 1e-5);
    EXPECT_NEAR(impact->normal.y, -1, 1e-5);
  }
}

TEST(SweepTest, MissesByACentimetreAreNone) {
  const GeometryPtr ball = Make(SphereShape{0.05});
  const double step = 500.0 / 60;
  const Vec3d from{-4, 0.06 + 0.5, 0}, to{-4 + step, 0.06 + 0.5, 0};
  for (const GeometryPtr& target : {Make(BoxShape{{.5, .5, .5}}), Make(SphereShape{0.5}),
                                    Make(CapsuleShape{0.25, 0.25}), Make(CylinderShape{0.5, 0.5})}) {
    EXPECT_FALSE(FirstImpact(Still(target), Straight(ball, from, to), kTarget_m));
    EXPECT_TRUE(
        FirstImpact(Still(target), Straight(ball, from - Vec3d{0, 0.02, 0}, to - Vec3d{0, 0.02, 0}), kTarget_m));
  }
}

TEST(SweepTest, BulletsHeadOnMeetHalfway) {
  const GeometryPtr ball = Make(SphereShape{0.01});
  const auto impact =
      FirstImpact(Straight(ball, {-4, 0, 0}, {4.3, 0, 0}), Straight(ball, {4, 0.005, 0}, {-4.3, .005, 0}), kTarget_m);
  ASSERT_TRUE(impact);
  const double touch = 0.02 + kTarget_m;
  EXPECT_NEAR(impact->fraction, (8 - std::sqrt(touch * touch - 0.005 * 0.005)) / 16.6, 1e-5);
}

TEST(SweepTest, RodThatSpinsInPlaceHitsAPostThatItsEndReaches) {
  const GeometryPtr rod = Make(BoxShape{{1, 0.02, 0.02}}), post = Make(SphereShape{0.05});
  // The rod turns by 2 rad, from along x to beyond y; the post stands at 60 degrees.
  const double at = std::numbers::pi / 3;
  for (const double r : {0.2, 0.9, 1.03}) {
    const Vec3d where{r * std::cos(at), r * std::sin(at), 0};
    const auto impact = FirstImpact(Turning(rod, {}, {}, {}, {0, 0, 2}), Still(post, where), kTarget_m);
    ASSERT_TRUE(impact) << r;
    EXPECT_NEAR(DistanceAt(Turning(rod, {}, {}, {}, {0, 0, 2}), Still(post, where), impact->fraction), kTarget_m, 2e-5);
  }
  EXPECT_FALSE(FirstImpact(Turning(rod, {}, {}, {}, {0, 0, 2}),
                           Still(post, Vec3d{std::cos(at), std::sin(at), 0} * 1.0522), kTarget_m));
}

TEST(SweepTest, AgreesWithBruteForceForAnyTwoShapes) {
  const std::vector<GeometryPtr> shapes = {
      Make(SphereShape{0.3}),
      Make(CapsuleShape{0.1, 0.6}),
      Make(BoxShape{{.9, .05, .3}}),
      Make(CylinderShape{0.4, 0.1}),
      Make(ConeShape{0.3, 0.9}),
      Make(ConvexHullShape{{{0, 0, 0.7f}, {0.5f, 0, -0.2f}, {-0.3f, 0.4f, -0.2f}, {-0.3f, -0.4f, -0.2f}}})};
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3d{uniform(random), uniform(random), uniform(random)}; };
  int hits = 0, misses = 0;
  for (const GeometryPtr& a : shapes) {
    for (const GeometryPtr& b : shapes) {
      for (int i = 0; i < 30; ++i) {
        const Vec3d away = Normalized(vector()) * 2.5, aim = vector() * 0.9;
        const SweptMotion motion_a = Turning(a, {}, vector(), TurnBy(vector() * 3.0), vector() * 1.7);
        const SweptMotion motion_b = Turning(b, away, aim - away, TurnBy(vector() * 3.0), vector() * 1.7);
        const auto impact = FirstImpact(motion_a, motion_b, kTarget_m);
        double least = 1e9;
        constexpr int kSamples = 400;
        const double end = impact ? impact->fraction : 1;
        for (int k = 0; k <= kSamples; ++k) least = std::min(least, DistanceAt(motion_a, motion_b, end * k / kSamples));
        ASSERT_GT(least, impact ? kTarget_m - 1e-6 : kTarget_m / 2 - 1e-6);
        if (impact) {
          ASSERT_LT(DistanceAt(motion_a, motion_b, impact->fraction), kTarget_m + 1.1e-5);
        }
        ++(impact ? hits : misses);
      }
    }
  }
  EXPECT_GT(hits, 300);
  EXPECT_GT(misses, 100);
}

TEST(SweepTest, IsTheSameFarFromTheOriginAndInEitherOrder) {
  const GeometryPtr rod = Make(BoxShape{{1, 0.02, 0.3}}), cone = Make(ConeShape{0.3, 0.8});
  const Vec3d far{1 << 20, -(1 << 21), 1 << 22};
  const auto at = [&](Vec3d o) {
    return std::pair{Turning(rod, o, o + Vec3d{1, .5, 0}, TurnBy({.2, .4, 1}), {1, -.5, .3}),
                     Turning(cone, o + Vec3d{2, 0, .25}, o + Vec3d{-2, .5, .125}, TurnBy({2, .5, 0}), {-1, 1, 0})};
  };
  const auto [a, b] = at({});
  const auto [far_a, far_b] = at(far);
  const auto here = FirstImpact(a, b, kTarget_m), there = FirstImpact(far_a, far_b, kTarget_m),
             reversed = FirstImpact(b, a, kTarget_m);
  ASSERT_TRUE(here && there && reversed);
  EXPECT_EQ(here->fraction, there->fraction);
  EXPECT_EQ(here->normal, there->normal);
  EXPECT_NEAR(here->fraction, reversed->fraction, 1e-5);
  EXPECT_LT(Length(here->normal + reversed->normal), 1e-3f);
}

TEST(SweepTest, RestingSlidingAndPartingBodiesMeetNothing) {
  const GeometryPtr box = Make(BoxShape{{.5, .5, .5}}), floor = Make(BoxShape{{50, .5, 50}});
  for (const double gap : {-0.004, -0.0002, 0.0, 0.0003, 0.0005}) {
    const Vec3d at{0, 1 + gap, 0};
    EXPECT_FALSE(FirstImpact(Still(floor), Straight(box, at, at), kTarget_m)) << gap;
    EXPECT_FALSE(FirstImpact(Still(floor), Straight(box, at, at + Vec3d{8, 0, 0}), kTarget_m)) << gap;
    EXPECT_FALSE(FirstImpact(Still(floor), Straight(box, at, at + Vec3d{3, 1, 0}), kTarget_m)) << gap;
    EXPECT_TRUE(FirstImpact(Still(floor), Straight(box, at, at - Vec3d{0, 3, 0}), kTarget_m)) << gap;
  }
}

TEST(SweepTest, SmallBallAboveAHugeMeshIsFoundToTheMicrometre) {
  const float wide = 4000;
  const GeometryPtr mesh = Make(TriangleMeshShape{
      {{-wide, 0, -wide}, {wide, 0, -wide}, {wide, 0, wide}, {-wide, 0, wide}}, {{0, 2, 1}, {0, 3, 2}}});
  const GeometryPtr ball = Make(SphereShape{0.01});
  const auto impact = FirstImpact(Still(mesh, {1e6, 0, 0}),
                                  Straight(ball, {1e6 + 1234.5, 4, 987.25}, {1e6 + 1236, -4, 990}), kTarget_m);
  ASSERT_TRUE(impact);
  EXPECT_NEAR(4 - 8 * impact->fraction, 0.01 + kTarget_m, 1.1e-5);
}

}  // namespace
}  // namespace tessera::physics
