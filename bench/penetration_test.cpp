#include "bench/penetration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace tessera::bench {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kExact = 1e-9;

Solid Box(double x, double y, double z) { return SolidOf(Shape{BoxShape{{x, y, z}}}); }
Solid Ball(double r) { return SolidOf(Shape{SphereShape{r}}); }
Solid Capsule(double r, double h) { return SolidOf(Shape{CapsuleShape{r, h}}); }
Solid At(const Solid& solid, Vec3d position, Quatd orientation = {}) { return Posed(solid, {position, orientation}); }
Quatd About(Vec3d axis, double angle) {
  const double s = std::sin(angle / 2);
  return {axis.x * s, axis.y * s, axis.z * s, std::cos(angle / 2)};
}

TEST(SolidTest, BallsOverlapByTheirRadiiLessTheirDistance) {
  EXPECT_NEAR(DepthBetween(At(Ball(1), {}), At(Ball(2), {2, 2, 1})), 0, kExact);
  EXPECT_NEAR(DepthBetween(At(Ball(1), {}), At(Ball(2), {1, 1, 0.5})), 1.5, kExact);
  EXPECT_NEAR(DepthBetween(At(Ball(1), {}), At(Ball(2), {4, 4, 2})), -3, kExact);
}

TEST(SolidTest, BoxesOverlapAlongTheAxisOfLeastDepth) {
  EXPECT_NEAR(DepthBetween(Box(1, 1, 1), At(Box(1, 1, 1), {0.3, 1.9, -0.2})), 0.1, kExact);
  EXPECT_LE(DepthBetween(Box(1, 1, 1), At(Box(1, 1, 1), {0, 2, 0})), kExact);
  EXPECT_LT(DepthBetween(Box(1, 1, 1), At(Box(1, 1, 1), {0, 2.5, 0})), 0);
}

TEST(SolidTest, ABoxOnItsEdgeIsAsDeepAsThatEdge) {
  const Quatd edge_down = About({0, 0, 1}, kPi / 4);
  const double reach = std::sqrt(2.0);
  EXPECT_NEAR(DepthBetween(Box(5, 1, 5), At(Box(1, 1, 1), {0, 1 + reach - 0.05, 0}, edge_down)), 0.05, kExact);
}

TEST(SolidTest, CrossedEdgesOverlapAlongTheirCommonNormal) {
  // Two boxes, each on an edge, the edges crossing at right angles one above the other.
  const Quatd ridge_x = About({1, 0, 0}, kPi / 4), ridge_z = About({0, 0, 1}, kPi / 4);
  const double reach = std::sqrt(2.0);
  EXPECT_NEAR(DepthBetween(At(Box(5, 1, 1), {}, ridge_x), At(Box(1, 1, 5), {0, 2 * reach - 0.03, 0}, ridge_z)), 0.03,
              kExact);
}

TEST(SolidTest, ABallAgainstFaceEdgeCornerAndInsideOfABox) {
  const Solid box = Box(1, 1, 1);
  EXPECT_NEAR(DepthBetween(box, At(Ball(0.5), {0.2, 1.4, 0.1})), 0.1, kExact);
  EXPECT_NEAR(DepthBetween(box, At(Ball(0.5), {1.3, 1.4, 0})), 0, kExact);
  EXPECT_NEAR(DepthBetween(box, At(Ball(1), {1 + 0.2, 1 + 0.3, 1 + 0.6})), 0.3, kExact);
  EXPECT_NEAR(DepthBetween(box, At(Ball(0.5), {0, 0.8, 0})), 0.7, kExact);
}

TEST(SolidTest, ACapsuleAgainstABoxABallAndACapsule) {
  const Quatd lying = About({0, 0, 1}, kPi / 2);
  EXPECT_NEAR(DepthBetween(Box(1, 1, 1), At(Capsule(0.4, 3), {0, 1.3, 0}, lying)), 0.1, kExact);
  EXPECT_NEAR(DepthBetween(Box(1, 1, 1), At(Capsule(0.4, 0.6), {0, 1.9, 0})), 0.1, kExact);
  EXPECT_NEAR(DepthBetween(Box(1, 1, 1), At(Capsule(0.4, 3), {0, 0.9, 0}, lying)), 0.5, kExact);  // its line is inside
  EXPECT_NEAR(DepthBetween(At(Capsule(0.4, 1), {}), At(Ball(0.3), {0, 1.6, 0})), 0.1, kExact);
  EXPECT_NEAR(DepthBetween(At(Capsule(0.4, 1), {}), At(Capsule(0.4, 1), {0, 0.5, 0.6}, lying)), 0.2, kExact);
  EXPECT_NEAR(DepthBetween(At(Capsule(0.4, 1), {}), At(Capsule(0.4, 1), {0.7, 0.3, 0})), 0.1, kExact);
}

TEST(SolidTest, AHullIsAsItsCorners) {
  const Solid wedge = SolidOf(Shape{ConvexHullShape{{{-1, 0, -1}, {1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {0, 2, 0}}}});
  EXPECT_NEAR(DepthBetween(At(wedge, {0, 0.95, 0}), Box(3, 1, 3)), 0.05, kExact);
  EXPECT_NEAR(DepthBetween(At(wedge, {}, About({1, 0, 0}, kPi)), At(Box(3, 1, 3), {0, -2.96, 0})), 0.04, 1e-6);
  EXPECT_NEAR(DepthBetween(wedge, At(Ball(1), {0, 2.9, 0})), 0.1, 1e-6);
}

TEST(SolidTest, ACylinderStandsAndLies) {
  const Solid cylinder = SolidOf(Shape{CylinderShape{0.5, 1}});
  EXPECT_NEAR(DepthInPlane(At(cylinder, {0, 0.99, 0}), {0, 1, 0}, 0), 0.01, 1e-7);
  EXPECT_NEAR(DepthInPlane(At(cylinder, {0, 0.49, 0}, About({0, 0, 1}, kPi / 2)), {0, 1, 0}, 0), 0.01, 2e-3);
}

TEST(SolidTest, ATriangleIsSolidBelow) {
  const Solid ground = PrismBelow({-5, 0, -5}, {-5, 0, 5}, {5, 0, 0}, 0.5);
  EXPECT_NEAR(DepthBetween(ground, At(Ball(0.5), {0, 0.45, 0})), 0.05, kExact);
  EXPECT_NEAR(DepthBetween(ground, At(Ball(0.2), {0, -0.1, 0})), 0.3, kExact);  // its middle is below the surface
  EXPECT_NEAR(DepthBetween(ground, At(Box(0.5, 0.5, 0.5), {0, 0.47, 0})), 0.03, kExact);
}

// --- Whole scenes

template <class Form>
BodyDef Body(std::uint64_t id, Form form, Vec3d position, bool dynamic = true) {
  BodyDef def;
  def.id = BodyId(id);
  def.shape = std::make_shared<const Shape>(Shape{std::move(form)});
  def.motion = dynamic ? Motion::kDynamic : Motion::kStatic;
  def.initial.position = position;
  return def;
}

Penetration AsPlaced(const Scene& scene) {
  std::vector<BodyState> states;
  for (const BodyDef& def : scene.bodies) states.push_back(def.initial);
  return Yardstick(scene).Measure(states);
}

TEST(YardstickTest, CountsEachPairOnceAndNamesTheDeepest) {
  Scene scene;
  scene.bodies = {Body(1, PlaneShape{}, {}, false), Body(2, BoxShape{{0.5, 0.5, 0.5}}, {0, 0.49, 0}),
                  Body(3, BoxShape{{0.5, 0.5, 0.5}}, {0, 1.46, 0}), Body(4, SphereShape{0.5}, {9, 0.5, 0})};
  const Penetration found = AsPlaced(scene);
  EXPECT_EQ(found.pairs, 2u);
  EXPECT_NEAR(found.deepest_m, 0.03, kExact);
  EXPECT_EQ(found.deepest_a, BodyId(2));
  EXPECT_EQ(found.deepest_b, BodyId(3));
  EXPECT_NEAR(found.sum_m, 0.04, kExact);
  EXPECT_NEAR(found.sum_of_squares_m2, 0.001, kExact);
  EXPECT_NEAR(found.mean_per_body_m, 0.04 / 3, kExact);
}

TEST(YardstickTest, AConePositionIsItsCentreOfMass) {
  Scene scene;
  scene.bodies = {Body(1, PlaneShape{}, {}, false), Body(2, ConeShape{1, 4}, {0, 0.98, 0})};
  EXPECT_NEAR(AsPlaced(scene).deepest_m, 0.02, 1e-6);  // a quarter of the height lies below it
}

TEST(YardstickTest, PartsOfACompoundMakeOnePair) {
  const auto cube = std::make_shared<const Shape>(Shape{BoxShape{{0.5, 0.5, 0.5}}});
  Scene scene;
  scene.bodies = {Body(1, PlaneShape{}, {}, false),
                  Body(2, CompoundShape{{{{{-1, 0, 0}, {}}, cube}, {{{1, 0, 0}, {}}, cube}}}, {0, 0.48, 0})};
  const Penetration found = AsPlaced(scene);
  EXPECT_EQ(found.pairs, 1u);
  EXPECT_NEAR(found.sum_m, 0.02, kExact);
}

TEST(YardstickTest, JointsExemptTheirBodiesAndTriggersAreNoMatter) {
  Scene scene;
  scene.gravity_m_s2 = {};
  scene.bodies = {Body(1, SphereShape{1}, {}), Body(2, SphereShape{1}, {1, 0, 0}),
                  Body(3, SphereShape{1}, {0.5, 0, 0})};
  scene.bodies[2].trigger = true;
  EXPECT_NEAR(AsPlaced(scene).deepest_m, 1, kExact);
  scene.joints.resize(1);
  scene.joints[0].body_a = BodyId(2);
  scene.joints[0].body_b = BodyId(1);
  EXPECT_EQ(AsPlaced(scene).pairs, 0u);
}

TEST(YardstickTest, AMeshIsMeasuredAtItsDeepestTriangle) {
  TriangleMeshShape mesh;
  mesh.vertices = {{-2, 0, -2}, {2, 0, -2}, {-2, 0, 2}, {2, 0, 2}};
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}};
  Scene scene;
  scene.bodies = {Body(1, mesh, {0, 1, 0}, false), Body(2, BoxShape{{0.5, 0.5, 0.5}}, {0.1, 1.46, 0})};
  const Penetration found = AsPlaced(scene);
  EXPECT_EQ(found.pairs, 1u);
  EXPECT_NEAR(found.deepest_m, 0.04, kExact);
}

}  // namespace
}  // namespace tessera::bench
