#include "core/region/lookahead_promise.h"

#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

// Region 1 has x < 0 and promises 8 ticks of 1/60 s; 4 more are looked ahead.
class LookaheadPromiseTest : public ::testing::Test {
 protected:
  std::uint32_t Promised(bool map_changes = false) {
    const std::vector<physics::Forces> forces(world.bodies.owned().size());
    LookaheadPromise promise(
        {world.bodies, world.catalog, world.neighborhood, settings, forces, SmallWorld::kTick_s, map_changes});
    return promise.For(RegionId(2), frame);
  }
  void OwnAt(double x, float speed, bool asleep = false) {
    BodyState state = world.InitialOf(1);
    state.position.x = x;
    state.linear_velocity = {speed, 0, 0};
    state.asleep = asleep;
    world.Own(1, state);
  }

  SmallWorld world{Balls({{-5, 0, 0}, {-5, 0, 5}})};
  RegionSettings settings{.promise_ticks = 8};
  BorderFrame frame;
};

TEST_F(LookaheadPromiseTest, NothingAwakeMayComeNearByThen) {
  OwnAt(-5, 30 / 1.4f);  // .2 s later about -.7, with its radius beyond the border
  EXPECT_EQ(Promised(), 0U);
  world.bodies.RemoveOwned(BodyId(1));
  OwnAt(-5, 15);
  EXPECT_EQ(Promised(), 8U);
}

TEST_F(LookaheadPromiseTest, SleepersInTheFrameStayWhileNothingHereIsAwake) {
  OwnAt(-0.5, 0, true);
  frame.ghosts.emplace_back();
  frame.ghosts[0].id = BodyId(1);
  frame.ghosts[0].state.asleep = true;
  EXPECT_EQ(Promised(), 8U);
  world.Own(2);
  EXPECT_EQ(Promised(), 0U);
}

TEST_F(LookaheadPromiseTest, AnAwakeGhostHereCountsToo) {
  BodyState near = world.InitialOf(2);
  near.position = {-0.7, 0, 0};
  world.AddGhost(2, 2, near);
  EXPECT_EQ(Promised(), 0U);
}

TEST_F(LookaheadPromiseTest, AFrameWithNewsPromisesNothing) {
  frame.acknowledgements.push_back({BodyId(1), Epoch(2)});
  EXPECT_EQ(Promised(), 0U);
  frame.acknowledgements.clear();
  EXPECT_EQ(Promised(true), 0U);
  settings.promise_ticks = 0;
  EXPECT_EQ(Promised(), 0U);
}

}  // namespace
}  // namespace tessera::region
