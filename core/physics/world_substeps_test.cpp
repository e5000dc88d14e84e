// Substeps that a world gives to an island, and the loads by which it does.
#include <gtest/gtest.h>

#include "core/physics/testing/bodies.h"
#include "core/physics/world.h"

namespace tessera::physics {
namespace {

// Cubes on each other, ids 2 and up.
void AddTower(World& world, std::uint64_t cubes) {
  world.Add(Static(1, Ground(), {}), {});
  for (std::uint64_t i = 0; i < cubes; ++i) {
    BodyDef cube = Dynamic(2 + i, Cube(), {0, static_cast<double>(i) + 0.5, 0});
    cube.may_sleep = false;
    world.Add(cube, cube.initial);
  }
}

TEST(SubstepTest, ATallTowerGetsThemInItsFirstSteps) {
  World world({});
  AddTower(world, 20);
  world.Step(kDt);
  EXPECT_GT(world.IslandLoadOf(BodyId(2)), 20);  // It counts at once: there is nothing to take a mean with.
  for (int i = 0; i < 5; ++i) world.Step(kDt);
  EXPECT_GE(world.SubstepsOf(BodyId(2)), 8);
  EXPECT_EQ(world.SubstepsOf(BodyId(21)), world.SubstepsOf(BodyId(2)));
}

TEST(SubstepTest, ABlowIsNoLoad) {
  World world({});
  AddTower(world, 5);
  Simulate(world, 1);
  const float load = world.IslandLoadOf(BodyId(2));
  const int substeps = world.SubstepsOf(BodyId(2));
  world.ApplyImpulse(BodyId(6), {0, -static_cast<float>(10 * world.MassOf(BodyId(6))), 0}, {});
  for (int i = 0; i < 3; ++i) {
    world.Step(kDt);
    EXPECT_EQ(world.SubstepsOf(BodyId(2)), substeps);
    EXPECT_LT(world.IslandLoadOf(BodyId(2)), 2 * load);
  }
}

TEST(SubstepTest, TheLoadOutsideTheWorldCounts) {
  World world({});
  AddTower(world, 2);
  Simulate(world, 1);
  ASSERT_EQ(world.SubstepsOf(BodyId(2)), 2);
  const float own = world.IslandLoadOf(BodyId(2));
  world.SetSupportHint(BodyId(3), {.island_load = 30});
  Simulate(world, 0.1);
  EXPECT_EQ(world.SubstepsOf(BodyId(2)), 8);
  EXPECT_NEAR(world.IslandLoadOf(BodyId(2)), own, 0.1 * own) << "the hint is not handed on";
}

TEST(SubstepTest, AFlyingBodyForgetsThem) {
  World world({});
  AddTower(world, 1);
  Simulate(world, 1);
  EXPECT_EQ(world.SubstepsOf(BodyId(2)), 2);
  world.ApplyImpulse(BodyId(2), {0, static_cast<float>(5 * world.MassOf(BodyId(2))), 0}, {});
  Simulate(world, 0.2);
  EXPECT_EQ(world.SubstepsOf(BodyId(2)), 0);
  EXPECT_EQ(world.IslandLoadOf(BodyId(2)), 0);
}

}  // namespace
}  // namespace tessera::physics
