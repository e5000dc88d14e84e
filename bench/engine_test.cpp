#include "bench/engine.h"
#include "bench/thread_cpu.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace tessera::bench {
namespace {

constexpr double kDt = 1.0 / 60;

template <class Form>
ShapePtr MakeShape(Form form) {
  return std::make_shared<const Shape>(Shape{std::move(form)});
}

BodyDef Dynamic(std::uint64_t id, ShapePtr shape, Vec3d position, double mass_kg = 1) {
  BodyDef def;
  def.id = BodyId(id);
  def.shape = std::move(shape);
  def.mass_kg = mass_kg;
  def.initial.position = position;
  return def;
}

BodyDef Ground(Material material = {}) {
  BodyDef def = Dynamic(1000, MakeShape(PlaneShape{}), {}, 0);
  def.motion = Motion::kStatic;
  def.material = material;
  return def;
}

Scene Empty(double gravity = 10) {
  Scene scene;
  scene.gravity_m_s2 = {0, -gravity, 0};
  return scene;
}

class EngineTest : public testing::TestWithParam<EngineKind> {
 protected:
  void SetUp() override {
    if (!EngineBuilt(GetParam())) GTEST_SKIP() << EngineName(GetParam()) << " was not installed at build time";
  }
  std::unique_ptr<Engine> Loaded(const Scene& scene, const EngineConfig& config = {}) {
    auto engine = MakeEngine(GetParam(), config);
    const absl::Status status = engine->Load(scene);
    EXPECT_TRUE(status.ok()) << status;
    return engine;
  }
  // False: skip the rest, since the engine says that it cannot.
  bool Can(const Scene& scene) {
    const absl::Status status = MakeEngine(GetParam(), {})->Load(scene);
    EXPECT_TRUE(status.ok() || absl::IsUnimplemented(status)) << status;
    return status.ok();
  }
  bool Is(EngineKind kind) const { return GetParam() == kind; }
};

INSTANTIATE_TEST_SUITE_P(Engines, EngineTest,
                         testing::Values(EngineKind::kTessera, EngineKind::kBullet, EngineKind::kOde,
                                         EngineKind::kMujoco, EngineKind::kBox3d, EngineKind::kJolt),
                         [](const auto& test) { return std::string(EngineName(test.param)); });

// Tessera by the parabola; the others velocity first, then position by the new velocity: y = -g dt^2 n (n + 1) / 2, too
// low by g t dt / 2.
TEST_P(EngineTest, FallsAsItsMethodSays) {
  Scene scene = Empty();
  scene.bodies = {Dynamic(1, MakeShape(SphereShape{0.5}), {1, 100, 2})};
  const auto engine = Loaded(scene);
  for (int i = 0; i < 60; ++i) engine->Step(kDt);
  const Vec3d end = engine->StateOf(BodyId(1)).position;
  EXPECT_DOUBLE_EQ(end.x, 1);
  EXPECT_DOUBLE_EQ(end.z, 2);
  const double first_order = 100 - 10 * kDt * kDt * 60 * 61 / 2;
  if (Is(EngineKind::kTessera)) {
    EXPECT_NEAR(end.y, 95, 1e-5);
  } else if (Is(EngineKind::kBox3d)) {
    EXPECT_NEAR(end.y, 95 - 10 * kDt / 4 / 2, 1e-3);  // it takes 4 substeps unless told otherwise
  } else {
    EXPECT_NEAR(end.y, first_order, 1e-3);
  }
}

TEST_P(EngineTest, FallsMoreTrulyInMoreSubsteps) {
  if (Is(EngineKind::kTessera)) GTEST_SKIP() << "its substeps are those of islands in contact";
  Scene scene = Empty();
  scene.bodies = {Dynamic(1, MakeShape(SphereShape{0.5}), {0, 100, 0})};
  const auto engine = Loaded(scene, {.substeps = 4});
  for (int i = 0; i < 60; ++i) engine->Step(kDt);
  EXPECT_NEAR(engine->StateOf(BodyId(1)).position.y, 95 - 10 * kDt / 4 / 2, 1e-3);
}

TEST_P(EngineTest, GivesBackTheStateItWasLoadedWith) {
  Scene scene = Empty(0);
  const Quatd turned = Normalized(Quatd{0.1, 0.2, 0.3, 0.9});
  // Lopsided: neither its centre of mass nor its axes are those of its coordinates.
  scene.bodies = {Dynamic(1, MakeShape(ConvexHullShape{{{0, 0, 0}, {3, 0, 0}, {0, 2, 0}, {0, 0, 1}}}), {1, 2, 3})};
  scene.bodies[0].initial.orientation = turned;
  scene.bodies[0].initial.linear_velocity = {1, -2, 3};
  scene.bodies[0].initial.angular_velocity = {0.3f, 0.2f, -0.1f};
  const auto engine = Loaded(scene);
  const BodyState state = engine->StateOf(BodyId(1));
  EXPECT_NEAR(Length(state.position - Vec3d{1, 2, 3}), 0, 1e-6);
  const double same = std::abs(state.orientation.x * turned.x + state.orientation.y * turned.y +
                               state.orientation.z * turned.z + state.orientation.w * turned.w);
  EXPECT_NEAR(same, 1, 1e-6);
  EXPECT_NEAR(Length(state.linear_velocity - Vec3f{1, -2, 3}), 0, 1e-5);
  EXPECT_NEAR(Length(state.angular_velocity - Vec3f{0.3f, 0.2f, -0.1f}), 0, 1e-5);
}

TEST_P(EngineTest, AForceActsForTheWholeOfOneStep) {
  for (const int substeps : {0, 3}) {
    Scene scene = Empty(0);
    scene.bodies = {Dynamic(1, MakeShape(BoxShape{{0.5, 0.5, 0.5}}), {}, 2)};
    const auto engine = Loaded(scene, {.substeps = substeps});
    engine->ApplyForce(BodyId(1), {12, 0, 0}, {0, 0, 6});
    engine->Step(0.1);
    engine->Step(0.1);
    const BodyState state = engine->StateOf(BodyId(1));
    EXPECT_NEAR(state.linear_velocity.x, 12.0 / 2 * 0.1, 1e-5) << substeps;
    EXPECT_NEAR(state.angular_velocity.z, 6 / (2.0 / 6) * 0.1, 1e-4) << substeps;  // I = m a^2 / 6
  }
}

// A pair's friction is the geometric mean of .8 and .2; the path to rest v^2 / (2 mu g).
TEST_P(EngineTest, FrictionOfAPairIsTheGeometricMean) {
  Scene scene = Empty();
  scene.bodies = {Dynamic(1, MakeShape(BoxShape{{0.5, 0.1, 0.5}}), {0, 0.1, 0}), Ground({.friction = 0.2})};
  scene.bodies[0].material.friction = 0.8;
  scene.bodies[0].initial.linear_velocity = {4, 0, 0};
  if (!Can(scene)) GTEST_SKIP() << "knows no such rule";
  const auto engine = Loaded(scene);
  for (int i = 0; i < 120; ++i) engine->Step(kDt);
  EXPECT_NEAR(engine->StateOf(BodyId(1)).position.x, 16 / (2 * 0.4 * 10), 0.15);  // in a step it goes .07 m
  EXPECT_NEAR(engine->StateOf(BodyId(1)).linear_velocity.x, 0, 1e-2);
}

TEST_P(EngineTest, ABallOnTheGroundComesBackWithItsRestitution) {
  Scene scene = Empty();
  scene.bodies = {Dynamic(1, MakeShape(SphereShape{0.5}), {0, 5.5, 0}), Ground()};
  scene.bodies[0].material = {.friction = 0, .rolling_friction = 0, .spinning_friction = 0, .restitution = 0.5};
  scene.bodies[1].material.friction = 0;
  const auto engine = Loaded(scene);
  double top = 0;
  for (int i = 0; i < 120; ++i) {  // it lands after 1 s and is up again half a second later
    engine->Step(kDt);
    if (i > 66) top = std::max(top, engine->StateOf(BodyId(1)).position.y - 0.5);
  }
  EXPECT_NEAR(top, 5 * 0.25, 0.35);  // a step's fall is .17 m, MuJoCo's contacts are springs
}

TEST_P(EngineTest, APointJointHoldsAPendulum) {
  Scene scene = Empty();
  scene.bodies = {Dynamic(1, MakeShape(SphereShape{0.1}), {1, 0, 0})};
  scene.joints.resize(1);
  scene.joints[0].id = JointId(1);
  scene.joints[0].body_a = BodyId(1);
  scene.joints[0].frame_a.position = {-1, 0, 0};
  if (!Can(scene)) GTEST_SKIP() << "has no joints here";
  const auto engine = Loaded(scene);
  for (int i = 0; i < 60; ++i) engine->Step(kDt);
  EXPECT_NEAR(Length(engine->StateOf(BodyId(1)).position), 1, 0.2);  // Bullet's rod has grown by 15 cm
}

TEST_P(EngineTest, ATwoBodyJointHoldsWhereItWasMade) {
  Scene scene = Empty(0);
  scene.bodies = {Dynamic(1, MakeShape(CapsuleShape{0.1, 0.4}), {0, 0, 0}),
                  Dynamic(2, MakeShape(CapsuleShape{0.1, 0.4}), {0, 1, 0})};
  scene.bodies[1].initial.linear_velocity = {2, 0, 0};
  scene.joints.resize(1);
  scene.joints[0].id = JointId(1);
  scene.joints[0].body_a = BodyId(1);
  scene.joints[0].body_b = BodyId(2);
  scene.joints[0].frame_a.position = {0, 0.5, 0};
  scene.joints[0].frame_b.position = {0, -0.5, 0};
  if (!Can(scene)) GTEST_SKIP() << "has no joints here";
  const auto engine = Loaded(scene);
  for (int i = 0; i < 60; ++i) engine->Step(kDt);
  const BodyState a = engine->StateOf(BodyId(1)), b = engine->StateOf(BodyId(2));
  const Vec3d gap =
      a.position + Rotate(a.orientation, Vec3d{0, 0.5, 0}) - b.position - Rotate(b.orientation, Vec3d{0, -0.5, 0});
  EXPECT_LT(Length(gap), 0.02);
  EXPECT_NEAR(a.linear_velocity.x + b.linear_velocity.x, 2, 1e-3);
}

TEST_P(EngineTest, BoxesAndHullsRestOnTheGround) {
  Scene scene = Empty();
  const ShapePtr wedge = MakeShape(ConvexHullShape{
      {{-1, 0, -1}, {1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {-1, 1, -1}, {1, 1, -1}, {-1, 1, 1}, {1, 1, 1}}});
  scene.bodies = {Dynamic(1, MakeShape(BoxShape{{1, 0.5, 1}}), {0, 0.51, 0}), Dynamic(2, wedge, {5, 0.51, 0}),
                  Ground()};
  const auto engine = Loaded(scene);
  for (int i = 0; i < 120; ++i) engine->Step(kDt);
  EXPECT_NEAR(engine->StateOf(BodyId(1)).position.y, 0.5, 0.02);
  EXPECT_NEAR(engine->StateOf(BodyId(2)).position.y, 0.5, 0.02);
}

TEST_P(EngineTest, SleepsOnlyIfItMay) {
  if (Is(EngineKind::kMujoco)) GTEST_SKIP() << "has no sleep";
  Scene scene = Empty();
  scene.bodies = {Dynamic(1, MakeShape(BoxShape{{0.5, 0.5, 0.5}}), {0, 0.5, 0}), Ground()};
  const auto with = Loaded(scene, {.sleep = true}), without = Loaded(scene);
  for (int i = 0; i < 300; ++i) {
    with->Step(kDt);
    without->Step(kDt);
  }
  EXPECT_TRUE(with->StateOf(BodyId(1)).asleep);
  EXPECT_FALSE(without->StateOf(BodyId(1)).asleep);
}

TEST_P(EngineTest, AMeshBearsWhatLiesOnIt) {
  Scene scene = Empty();
  BodyDef floor = Dynamic(
      1000, MakeShape(TriangleMeshShape{{{-5, 0, -5}, {-5, 0, 5}, {5, 0, 5}, {5, 0, -5}}, {{0, 1, 2}, {0, 2, 3}}}), {},
      0);
  floor.motion = Motion::kStatic;
  scene.bodies = {Dynamic(1, MakeShape(BoxShape{{0.5, 0.5, 0.5}}), {1, 0.55, 0}),
                  Dynamic(2, MakeShape(CapsuleShape{0.3, 0.4}), {-2, 0.75, 0}), floor};
  if (!Can(scene)) GTEST_SKIP() << "knows no meshes";
  const auto engine = Loaded(scene);
  for (int i = 0; i < 60; ++i) engine->Step(kDt);
  EXPECT_NEAR(engine->StateOf(BodyId(1)).position.y, 0.5, 0.03);
  EXPECT_GT(engine->StateOf(BodyId(2)).position.y, 0.25);  // the rod may have fallen over
}

TEST_P(EngineTest, TwoThreadsStepATower) {
  Scene scene = Empty();
  scene.bodies = {Ground()};
  for (std::uint64_t i = 0; i < 40; ++i) {
    const auto column = static_cast<double>(i / 4), layer = static_cast<double>(i % 4);
    scene.bodies.push_back(Dynamic(i + 1, MakeShape(BoxShape{{0.5, 0.5, 0.5}}), {2 * column, 0.5 + layer, 0}));
  }
  const auto engine = Loaded(scene, {.threads = 2});
  for (int i = 0; i < 60; ++i) engine->Step(kDt);
  for (std::uint64_t i = 0; i < 40; ++i) {
    EXPECT_NEAR(engine->StateOf(BodyId(i + 1)).position.y, 0.5 + static_cast<double>(i % 4), 0.1) << i;
  }
}

TEST(EngineTest, APeerNamesTheCommitItWasBuiltFrom) {
  for (const EngineKind kind : {EngineKind::kBox3d, EngineKind::kJolt}) {
    EXPECT_EQ(EngineCommit(kind).empty(), !EngineBuilt(kind)) << EngineName(kind);
  }
  EXPECT_EQ(EngineCommit(EngineKind::kBullet), "");
}

TEST(EngineTest, MujocoKeepsItsEnergyByRungeAndKutta) {
  if (!EngineBuilt(EngineKind::kMujoco)) GTEST_SKIP() << "not installed at build time";
  Scene scene = Empty(0);
  scene.bodies = {Dynamic(1, MakeShape(BoxShape{{0.1, 0.2, 0.3}}), {})};
  scene.bodies[0].inertia_kg_m2 = Vec3d{1, 2, 3};
  scene.bodies[0].initial.angular_velocity = {0.01f, 10, 0.01f};
  const auto energy_after = [&](const EngineConfig& config) {
    const auto engine = MakeEngine(EngineKind::kMujoco, config);
    EXPECT_TRUE(engine->Load(scene).ok());
    for (int i = 0; i < 300; ++i) engine->Step(kDt);
    const BodyState state = engine->StateOf(BodyId(1));
    const Vec3d w = Rotate(Conjugate(state.orientation), Vec3d(state.angular_velocity));
    return (w.x * w.x + 2 * w.y * w.y + 3 * w.z * w.z) / 2;
  };
  EXPECT_NEAR(energy_after({.rk4 = true}), 100, 0.1);
  EXPECT_GT(std::abs(energy_after({}) - 100), 1);
}

TEST(EngineTest, MujocoDoesNotHideThatItBlewUp) {
  if (!EngineBuilt(EngineKind::kMujoco)) GTEST_SKIP() << "not installed at build time";
  Scene scene = Empty(0);
  scene.bodies = {Dynamic(1, MakeShape(BoxShape{{0.1, 0.2, 0.3}}), {})};
  scene.bodies[0].initial.linear_velocity = {1e9f, 0, 0};  // beyond what it lets pass, 1e10 m, in ten steps
  const auto engine = MakeEngine(EngineKind::kMujoco, {});
  ASSERT_TRUE(engine->Load(scene).ok());
  for (int i = 0; i < 20; ++i) engine->Step(1);
  EXPECT_FALSE(IsFinite(engine->StateOf(BodyId(1)).position));
}

TEST(EngineTest, SaysWhatItLacks) {
  Scene scene = Empty();
  scene.bodies = {Dynamic(1, MakeShape(SphereShape{1}), {}), Dynamic(2, MakeShape(SphereShape{1}), {5, 0, 0})};
  scene.bodies[0].material.restitution = 1;
  const absl::Status status = MakeEngine(EngineKind::kBullet, {})->Load(scene);
  EXPECT_TRUE(absl::IsUnimplemented(status));
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("restitution"));
}

TEST(CpuClockTest, CountsWorkOfThisThread) {
  const double start = ThreadCpuSeconds();
  double last = start;
  while (last < start + 1e-3) {  // ends only if the clock counts
    const double now = ThreadCpuSeconds();
    EXPECT_GE(now, last);
    last = now;
  }
}

}  // namespace
}  // namespace tessera::bench
