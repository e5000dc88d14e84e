// Each shape comes to rest, on each kind of ground, where it must.
#include <gmock/gmock.h>

#include <cmath>
#include <string>

#include "core/physics/mass_properties.h"
#include "core/physics/testing/bodies.h"

namespace tessera::physics {
namespace {

// The furthest that a body moves in the first ticks of a pile of boxes that is made anew from its state alone, after
// its contacts were primed so many times, m.
double JoltOfASavedPile(int primings) {
  World pile({}), again({});
  std::vector<BodyDef> defs = {Static(1, Ground(), {})};
  std::uint64_t id = 2;
  for (int row = 0; row < 10; ++row) {
    for (int i = 0; i < 10 - row; ++i) {
      defs.push_back(Dynamic(id++, Cube(), {i + 0.5 * row, 0.5 + row, 0}));
      defs.back().may_sleep = false;
    }
  }
  for (const BodyDef& def : defs) pile.Add(def, def.initial);
  for (int tick = 0; tick < 600; ++tick) pile.Step(1.0 / 60);
  for (const BodyDef& def : defs) again.Add(def, pile.StateOf(def.id));
  again.PrimeContacts(1.0 / 60, primings);
  for (const BodyDef& def : defs) EXPECT_EQ(again.StateOf(def.id), pile.StateOf(def.id));
  double furthest = 0;
  for (int tick = 0; tick < 5; ++tick) {
    pile.Step(1.0 / 60);
    again.Step(1.0 / 60);
    if (tick == 0) {
      EXPECT_GE(again.events().size(), 100U);  // The step reports them, not the priming.
    }
    for (const BodyDef& def : defs) {
      furthest = std::max(furthest, Length(again.StateOf(def.id).position - pile.StateOf(def.id).position));
    }
  }
  return furthest;
}

TEST(PrimedContactsTest, APileThatWasSavedHardlySags) {
  const double cold = JoltOfASavedPile(0), primed = JoltOfASavedPile(6);
  std::printf("a saved pile sags by %.2e m, primed by %.2e m\n", cold, primed);
  EXPECT_LT(primed, 2e-4);
  EXPECT_LT(primed, cold / 4);
}

// A wall is the worst of all piles: it can sway, with hardly anything to stop it.
TEST(RestingTest, AWallOfBoxesStandsStill) {
  World wall({});
  std::vector<BodyDef> defs = {Static(1, Ground(), {})};
  std::uint64_t id = 2;
  for (int row = 0; row < 10; ++row) {
    for (int i = 0; i < 10 - row; ++i) {
      defs.push_back(Dynamic(id++, Cube(), {1.02 * (i + 0.5 * row), 0.5 + row, 0}));
      defs.back().may_sleep = false;
    }
  }
  for (const BodyDef& def : defs) wall.Add(def, def.initial);
  for (int tick = 0; tick < 1800; ++tick) wall.Step(1.0 / 60);
  double fastest = 0, furthest = 0;
  for (const BodyDef& def : defs) {
    const BodyState state = wall.StateOf(def.id);
    fastest = std::max(fastest, static_cast<double>(Length(state.linear_velocity)));
    furthest = std::max(furthest, Length(state.position - def.initial.position));
  }
  std::printf("a wall of 55 boxes after 30 s: %.1e m/s, furthest moved %.1e m\n", fastest, furthest);
  EXPECT_LT(fastest, 2e-3);  // swept in one direction alone, it sways at .4 m/s by 5 cm for ever
  EXPECT_LT(furthest, 0.01);
}

TEST(PrimedContactsTest, KeepForcesForTheStep) {
  World world({.gravity_m_s2 = {}});
  const BodyDef one = Dynamic(1, Cube(), {}), two = Dynamic(2, Cube(), {1, 0, 0});
  world.Add(one, one.initial);
  world.Add(two, two.initial);
  world.ApplyForce(BodyId(1), {0, 60, 0}, {});
  world.ApplyForce(BodyId(2), {0, 60, 0}, {});
  world.PrimeContacts(1.0 / 60, 6);
  world.Step(1.0 / 60);
  EXPECT_NEAR(world.StateOf(BodyId(1)).linear_velocity.y, 1 / one.mass_kg, 1e-6);
  EXPECT_NEAR(world.StateOf(BodyId(2)).linear_velocity.y, 1 / two.mass_kg, 1e-6);
}

constexpr double kBase_m = 3;  // height of the ground

struct Lying {
  std::string name;
  ShapePtr shape;
  double height_m;  // centre of mass above the ground
};

ShapePtr CubeHull(Vec3f center) {
  ConvexHullShape hull;
  for (int i = 0; i < 8; ++i) {
    hull.points.push_back(center + Vec3f{i & 1 ? 0.5f : -0.5f, i & 2 ? 0.5f : -0.5f, i & 4 ? 0.5f : -0.5f});
  }
  return MakeShapePtr(std::move(hull));
}

// A table: a top (2 x .2 x 2) on a foot (.8 x 1 x .8).
ShapePtr Table() {
  return MakeShapePtr(CompoundShape{{{{{0, 1.1, 0}, {}}, Box(1, 0.1, 1)}, {{{0, 0.5, 0}, {}}, Box(0.4, 0.5, 0.4)}}});
}

std::vector<Lying> Shapes() {
  return {{"Box", Cube(), 0.5},
          {"Sphere", Ball(), 0.5},
          {"Capsule", MakeShapePtr(CapsuleShape{0.5, 0.6}), 1.1},
          {"Cylinder", MakeShapePtr(CylinderShape{0.5, 0.6}), 0.6},
          {"Cone", MakeShapePtr(ConeShape{0.8, 1.2}), 0.3},
          {"Hull", CubeHull({}), 0.5},
          {"HullOffCenter", CubeHull({4, 5, 6}), 0.5},
          {"Compound", Table(), (0.8 * 1.1 + 0.64 * 0.5) / (0.8 + 0.64)}};
}

ShapePtr FlatMesh() {
  TriangleMeshShape mesh;
  mesh.vertices = {{-20, 0, -20}, {20, 0, -20}, {20, 0, 20}, {-20, 0, 20}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  return MakeShapePtr(std::move(mesh));
}

// Flat but for one corner, so that the lowest and the highest point differ and Bullet's centring would show.
ShapePtr FlatField() {
  HeightFieldShape field{.columns = 21, .rows = 21, .spacing_m = 2, .heights_m = std::vector<float>(441, 1)};
  field.heights_m[0] = 7;
  return MakeShapePtr(std::move(field));
}

std::vector<BodyDef> Grounds() {
  return {Static(1, Ground(), {0, kBase_m, 0}), Static(1, MakeShapePtr(PlaneShape{{0, 2, 0}, 2 * kBase_m})),
          Static(1, FlatMesh(), {0, kBase_m, 0}), Static(1, FlatField(), {0, kBase_m - 1, 0}),
          Static(1, Box(20, 1, 20), {0, kBase_m - 1, 0})};
}

TEST(RestingTest, EveryShapeLiesOnEveryGround) {
  for (const BodyDef& ground : Grounds()) {
    for (const Lying& lying : Shapes()) {
      SCOPED_TRACE(lying.name + " on " + std::to_string(ground.shape->form.index()));
      World world({});
      BodyDef body = Dynamic(2, lying.shape, {0.3, kBase_m + lying.height_m + 0.02, 0.2});
      body.material.rolling_friction = body.material.spinning_friction = 0.02;
      AddAll(world, {ground, body});
      Simulate(world, 8);
      const BodyState state = world.StateOf(body.id);
      EXPECT_NEAR(state.position.y - kBase_m, lying.height_m, 3e-3);
      EXPECT_GT(Rotate(state.orientation, {0, 1, 0}).y, 0.9999);
      EXPECT_TRUE(state.asleep);
    }
  }
}

// --- Edges inside a surface

// A grid of 1 m cells; `height` of a vertex by its x.
template <class Height>
ShapePtr GridMesh(Height height) {
  constexpr std::uint32_t kCells = 80;
  TriangleMeshShape mesh;
  for (std::uint32_t i = 0; i < (kCells + 1) * (kCells + 1); ++i) {
    const std::uint32_t column = i % (kCells + 1), row = i / (kCells + 1);
    const float x = static_cast<float>(column) - 40, z = static_cast<float>(row) - 40;
    mesh.vertices.push_back({x, height(x), z});
  }
  for (std::uint32_t z = 0; z < kCells; ++z) {
    for (std::uint32_t x = 0; x < kCells; ++x) {
      const std::uint32_t a = z * (kCells + 1) + x, below = a + kCells + 1;
      mesh.triangles.push_back({a, below, a + 1});
      mesh.triangles.push_back({a + 1, below, below + 1});
    }
  }
  return MakeShapePtr(std::move(mesh));
}

TEST(EdgeTest, FlatTrianglesAreAsSmoothAsAPlane) {
  const ShapePtr mesh = GridMesh([](float) { return 0.0f; });
  const ShapePtr field = MakeShapePtr(
      HeightFieldShape{.columns = 81, .rows = 81, .spacing_m = 1, .heights_m = std::vector<float>(81 * 81, 0.0f)});
  for (const ShapePtr& surface : {mesh, field}) {
    for (const bool ball : {true, false}) {
      World world({});
      BodyDef ground = Static(1, surface),
              body = Dynamic(2, ball ? Ball(0.3) : Cube(0.3), {-30, 0.299, 0.37});  // as it rests
      body.initial.linear_velocity = {8, 0, 0.5f};
      if (ball) body.initial.angular_velocity = {0.5f / 0.3f, 0, -8 / 0.3f};
      if (!ball) ground.material.friction = 0;
      AddAll(world, {ground, body});
      double highest = 0;
      for (int i = 0; i < 300; ++i) {
        world.Step(kDt);
        highest = std::max(highest, world.StateOf(body.id).position.y);
      }
      EXPECT_LT(highest, 0.302) << ball;
      EXPECT_NEAR(world.StateOf(body.id).position.x, 10, 0.03) << ball;
      EXPECT_NEAR(world.StateOf(body.id).linear_velocity.x, 8, 0.02) << ball;
    }
  }
}

// Real edges stay: over a ridge and through a valley a ball keeps to the surface and to its energy.
TEST(EdgeTest, RidgesAndValleysAreFollowed) {
  const float slope = 0.1f;
  const auto surface = [slope](auto x) { return x < 0 ? slope * x : x < 10 ? -slope * x : slope * (x - 20); };
  const double stretch = std::sqrt(1 + slope * slope);
  World world({});
  BodyDef ball = Dynamic(2, Ball(0.3), {-8, -0.8 + 0.3 * stretch, 0.4});
  ball.initial.linear_velocity = {4, 4 * slope, 0};
  ball.initial.angular_velocity = {0, 0, static_cast<float>(-4 * stretch / 0.3)};
  AddAll(world, {Static(1, GridMesh(surface)), ball});
  double farthest = 0;
  for (int i = 0; i < 600 && world.StateOf(ball.id).position.x < 18; ++i) {
    world.Step(kDt);
    const Vec3d p = world.StateOf(ball.id).position;
    farthest = std::max(farthest, std::abs((p.y - surface(p.x)) / stretch - 0.3));
  }
  const Vec3d end = world.StateOf(ball.id).position;
  EXPECT_GE(end.x, 18);
  EXPECT_LT(farthest, 0.02);
  // 7/10 v^2 + g h is kept, but for the velocity into the valley's other side, which is lost there.
  const auto speed_squared = [&](double y) {
    return 16 * stretch * stretch - kGravity * (y - ball.initial.position.y) / 0.7;
  };
  const double into_valley = std::sin(2 * std::atan(slope));
  const double expected = speed_squared(end.y) - speed_squared(-1 + 0.3 * stretch) * into_valley * into_valley;
  EXPECT_NEAR(LengthSquared(Vec3d(world.StateOf(ball.id).linear_velocity)), expected, 0.04 * expected);
}

// The same plane in a world whose origin is 100 km along it; errors would show on a slanted plane.
TEST(RestingTest, PlaneIsWhereItIsFarFromItsOwnOrigin) {
  const Vec3d normal = Normalized(Vec3d{1, 2, 0});
  const Vec3d down{2 / std::sqrt(5.0), -1 / std::sqrt(5.0), 0};  // along the slope
  const Vec3d far = down * 1e5;
  World world({.origin = far, .gravity_m_s2 = normal * -kGravity});
  BodyDef body = Dynamic(2, Ball(), far + normal * 0.52);
  body.material.rolling_friction = 0.02;
  AddAll(world, {Static(1, MakeShapePtr(PlaneShape{normal, 0})), body});
  Simulate(world, 4);
  EXPECT_NEAR(Dot(world.StateOf(body.id).position, normal), 0.5, 3e-3);
}

TEST(RestingTest, HeightFieldHasItsHeightsWhereTheyWereGiven) {
  // A ramp in x, a step in z: heights[z * columns + x].
  HeightFieldShape field{.columns = 5, .rows = 3, .spacing_m = 2, .heights_m = {}};
  for (int z = 0; z < 3; ++z)
    for (int x = 0; x < 5; ++x) field.heights_m.push_back(static_cast<float>(x) + 10.0f * static_cast<float>(z));
  World world({});
  const BodyDef ground = Static(1, MakeShapePtr(field), {100, 50, 200});
  AddAll(world, {ground});
  for (int z = 0; z < 3; ++z) {
    for (int x = 0; x < 5; ++x) {
      // Just inside, for the outermost samples.
      const double px = 100 + (x - 2) * 2 * 0.999, pz = 200 + (z - 1) * 2 * 0.999;
      const auto hits = world.FindBodies({.from = {px, 200, pz}, .to = {px, 0, pz}}).hits;
      ASSERT_FALSE(hits.empty()) << x << ' ' << z;
      EXPECT_NEAR(hits[0].point.y, 50 + x + 10 * z, 0.03) << x << ' ' << z;
    }
  }
}

// --- Waking

TEST(WakingTest, AStateThatMovesABodyWakesWhatItIsJointedTo) {
  World world({});
  const BodyDef top = Dynamic(2, Cube(0.2), {}), hung = Dynamic(3, Cube(0.2), {0, -1, 0});
  AddAll(world, {top, hung});
  JointDef hook;
  hook.id = JointId(1);
  hook.body_a = top.id;
  hook.kind = FixedJoint{};
  JointDef chain;
  chain.id = JointId(2);
  chain.body_a = top.id, chain.body_b = hung.id;
  chain.frame_b.position = {0, 1, 0};
  chain.kind = FixedJoint{};
  world.AddJoint(hook);
  world.AddJoint(chain);
  Simulate(world, 5);
  ASSERT_EQ(world.asleep_count(), 2u);
  BodyState pushed = world.StateOf(top.id);
  pushed.position.x += 0.01;
  pushed.asleep = false;
  world.SetState(top.id, pushed);
  EXPECT_EQ(world.asleep_count(), 0u);
}

TEST(WakingTest, WhatCameAsleepFallsWhenItsSupportIsTaken) {
  World world({});
  BodyDef low = Dynamic(2, Cube(), {0, 0.5, 0}), high = Dynamic(3, Cube(), {0, 1.5, 0});
  low.initial.asleep = high.initial.asleep = true;
  AddAll(world, {Static(1, Ground()), low, high});
  for (const bool stepped : {false, true}) {
    if (stepped) {
      world.Add(low, low.initial);
      BodyState back = high.initial;
      world.SetState(high.id, back);
      Simulate(world, 1);
      ASSERT_EQ(world.asleep_count(), 2u);
    }
    world.Remove(low.id);
    EXPECT_EQ(world.asleep_count(), 0u) << stepped;
    Simulate(world, 2);
    EXPECT_NEAR(world.StateOf(high.id).position.y, 0.5, 0.01);
  }
}

}  // namespace
}  // namespace tessera::physics
