#include "core/physics/world.h"

#include <gmock/gmock.h>

#include "core/physics/test_bodies.h"

namespace tessera::physics {
namespace {

TEST(WorldTest, BoxComesToRestOnThePlane) {
  World world({});
  AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.6, 0})});
  Simulate(world, 5);
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.y, 0.5, 2e-3);
  EXPECT_EQ(world.asleep_count(), 1u);
}

TEST(WorldTest, BallComesToRestOnTheBox) {
  World world({});
  AddAll(world, {Static(1, Cube(1)), Dynamic(2, Ball(), {0, 1.6, 0})});
  Simulate(world, 5);
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.y, 1.5, 2e-3);
  EXPECT_EQ(world.asleep_count(), 1u);
}

}  // namespace
}  // namespace tessera::physics
