// Loads of thousands of times what bears them: they stand, they fall where they should, and nobody else notices.
#include <gtest/gtest.h>

#include <cmath>

#include "core/physics/testing/bodies.h"
#include "core/physics/tuning.h"
#include "core/physics/world.h"
#include "scenes/measured/builder.h"
#include "scenes/measured/stacks.h"

namespace tessera::physics {
namespace {

void Fill(World& world, const Scene& scene) {
  for (const BodyDef& body : scene.bodies) world.Add(body, body.initial);
}

// The state of the load after so many seconds.
BodyState LoadAfter(const scenes::HeavyLoad& load, double seconds, WorldSettings settings = {}) {
  const Scene scene = scenes::HeavyLoadStack(load);
  settings.gravity_m_s2 = scene.gravity_m_s2;
  World world(settings);
  Fill(world, scene);
  Simulate(world, seconds);
  return world.StateOf(scene.bodies.back().id);
}

class HeavyLoadTest : public ::testing::TestWithParam<int> {};

TEST_P(HeavyLoadTest, StandsOnBoxesThreeThousandTimesLighter) {
  constexpr double kDegree = 0.0174533;
  for (const double size : {0.2, 1.0}) {
    for (const double lean : {0.0, kDegree}) {
      const scenes::HeavyLoad load{.n = GetParam(), .size_m = size, .ratio = 3000, .lean_rad = lean};
      const BodyState state = LoadAfter(load, 5);
      EXPECT_NEAR(state.position.y, size * (GetParam() + 0.5), 0.001 * size) << size << " m, lean " << lean;
      EXPECT_NEAR(state.position.x, 0, 0.001 * size) << size << " m, lean " << lean;
      EXPECT_LT(Length(state.linear_velocity), 1e-3F);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Heights, HeavyLoadTest, ::testing::Values(5, 10, 20));

// A load whose middle is over the stack stands; one whose middle is beyond the edge turns about it as a rigid body.
TEST(HeavyLoadOffCenterTest, FallsWhereItsMiddleIsBeyondTheEdge) {
  EXPECT_NEAR(LoadAfter({.n = 5, .aside_m = 0.45}, 5).position.y, 5.5, 0.002);
  EXPECT_LT(LoadAfter({.n = 5, .aside_m = 0.55}, 5).position.y, 3);
  EXPECT_LT(LoadAfter({.n = 5, .aside_m = -0.55}, 5).position.y, 3);
  constexpr double kSeconds = 0.25, kArm = 0.1, kHigh = 0.5;
  const double rate = kGravity * kArm / (1.0 / 6 + kArm * kArm + kHigh * kHigh) * kSeconds;  // while turns are small
  EXPECT_NEAR(-LoadAfter({.n = 5, .aside_m = 0.6}, kSeconds).angular_velocity.z, rate, 0.15 * rate);
}

// 64 substeps hold it, and it does not sway; above the bound the same stack is solved together, with four.
TEST(HeavyLoadBoundTest, ALoadThatSubstepsHoldIsLeftToThem) {
  for (const double ratio : {80.0, 100.0, 1100.0}) {
    const Scene scene = scenes::HeavyLoadStack({.n = 10, .ratio = ratio});
    World world({.gravity_m_s2 = scene.gravity_m_s2});
    Fill(world, scene);
    Simulate(world, 10);
    const BodyId load = scene.bodies.back().id;
    EXPECT_EQ(world.SubstepsOf(load), ratio > 1000 ? 4 : 64) << ratio;
    for (const BodyDef& body : scene.bodies) {
      EXPECT_LT(Length(world.StateOf(body.id).linear_velocity), 1e-3F) << ratio << ", body " << body.id;
    }
    EXPECT_NEAR(world.StateOf(load).position.y, 10.5, 0.01) << ratio;
  }
}

// It throws the stack over, as no substeps hold it; but the boxes get no more than that fall gives.
TEST(HeavyLoadBoundTest, ALoadThatComesDownThrowsNoBoxOut) {
  Scene scene = scenes::HeavyLoadStack({.n = 5, .ratio = 3000});
  scene.bodies.back().initial.position.y += 0.1;
  World world({.gravity_m_s2 = scene.gravity_m_s2});
  Fill(world, scene);
  for (int step = 0; step < 360; ++step) {
    world.Step(kDt);
    for (const BodyDef& body : scene.bodies) ASSERT_LT(Length(world.StateOf(body.id).linear_velocity), 20) << step;
  }
}

TEST(HeavyLoadSettingsTest, ThreadsAndInstructionSetsChangeNoBit) {
  const scenes::HeavyLoad load{.n = 10, .lean_rad = 0.0175, .aside_m = 0.1};
  const BodyState state = LoadAfter(load, 1);
  for (const WorldSettings& settings : {WorldSettings{.threads = 2}, WorldSettings{.portable = true}}) {
    const BodyState other = LoadAfter(load, 1, settings);
    EXPECT_EQ(other.position, state.position);
    EXPECT_EQ(other.orientation, state.orientation);
    EXPECT_EQ(other.angular_momentum, state.angular_momentum);
  }
}

TEST(HeavyLoadCompanyTest, AnotherIslandChangesNoBit) {
  const Scene scene = scenes::HeavyLoadStack({.n = 5, .lean_rad = 0.0175});
  World alone({.gravity_m_s2 = scene.gravity_m_s2}), together({.gravity_m_s2 = scene.gravity_m_s2});
  Fill(alone, scene);
  Fill(together, scene);
  for (std::uint64_t i = 0; i < 5; ++i) {
    const BodyDef def = Dynamic(100 + i, Cube(), {10, static_cast<double>(i) + 0.5, 0}, i == 4 ? 2000 : 1);
    together.Add(def, def.initial);
  }
  Simulate(alone, 1);
  Simulate(together, 1);
  EXPECT_EQ(together.StateOf(scene.bodies.back().id).position, alone.StateOf(scene.bodies.back().id).position);
}

// More contacts under a load than are solved together: the island gets all substeps there are.
TEST(HeavyLoadSizeTest, AnIslandOfTooManyLoadedContactsIsLeftToItsSubsteps) {
  World world({});
  world.Add(Static(1, Ground()), {});
  constexpr int kSide = 9;
  static_assert(kSide * kSide > kMostBearing);
  std::uint64_t id = 2;
  for (int i = 0; i < kSide * kSide; ++i) {
    const BodyDef cube = Dynamic(id++, Cube(), {1.2 * (i % kSide), 0.5, 1.2 * (i / kSide)});
    world.Add(cube, cube.initial);
  }
  const double middle = 1.2 * (kSide - 1) / 2;
  const BodyDef slab = Dynamic(id, Box(6, 0.5, 6), {middle, 1.5, middle}, 1e6);
  world.Add(slab, slab.initial);
  Simulate(world, 0.2);
  EXPECT_EQ(world.SubstepsOf(slab.id), 64);
  World few({});
  few.Add(Static(1, Ground()), {});
  for (std::uint64_t i = 0; i < 9; ++i) {
    const BodyDef cube =
        Dynamic(2 + i, Cube(), {1.2 * static_cast<double>(i % 3), 0.5, 1.2 * static_cast<double>(i / 3)});
    few.Add(cube, cube.initial);
  }
  const BodyDef plate = Dynamic(20, Box(2, 0.5, 2), {1.2, 1.5, 1.2}, 1e6);
  few.Add(plate, plate.initial);
  Simulate(few, 2);
  EXPECT_LE(few.SubstepsOf(plate.id), 8);
  EXPECT_NEAR(few.StateOf(plate.id).position.y, 1.5, 0.01);
}

TEST(PressTest, NothingIsPressedThroughAThinWall) {
  for (const float newtons : {500.0F, 3000.0F, 20000.0F}) {
    for (const double heavy : {10.0, 100.0}) {
      for (const bool ball : {false, true}) {
        const Scene scene = scenes::PressAgainstWall({.heavy_kg = heavy, .ball = ball});
        World world({});
        Fill(world, scene);
        for (int i = 0; i < 120; ++i) {
          world.ApplyForce(scenes::kPresser, {newtons, 0, 0}, {});
          world.Step(kDt);
          for (const BodyId body : {scenes::kPressed, scenes::kPresser}) {
            const Vec3d at = world.StateOf(body).position;
            const bool past_the_end = std::abs(at.z) > 2 || at.y > 4;  // squeezed out, or rolled up the wall
            ASSERT_TRUE(at.x < 0 || past_the_end) << newtons << " N, " << heavy << " kg, " << ball;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace tessera::physics
