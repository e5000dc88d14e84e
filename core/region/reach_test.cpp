#include "core/region/reach.h"

#include <gtest/gtest.h>

namespace tessera::region {
namespace {

// Two cells that meet in x = 0; a ball of .5 m with an aura of 1 m, looking 4 ticks of 1/60 s ahead.
class ReachTest : public ::testing::Test {
 protected:
  bool Shown(double x, float speed, bool asleep = false) {
    BodyState state;
    state.position = {x, 0, 0};
    state.linear_velocity = {speed, 0, 0};
    state.asleep = asleep;
    reach.Clear(1);
    looked = reach.Look(0, def, state, {}, 0.5);
    return reach.Shows(0, 0);
  }

  const PartitionMap map = *MakeGridMap({-50, -50, 50, 50}, 2);
  const std::vector<RegionId> neighbors = map.Neighbors(RegionId(1));
  const BodyDef def{};
  Reach reach{map, RegionId(1), neighbors, Settings{.aura_m = 1}, 1.0 / 60};
  bool looked = false;
};

TEST_F(ReachTest, ABodyIsShownFromItsRadiusAndTheAuraOn) {
  EXPECT_FALSE(Shown(-1.6, 0));
  EXPECT_TRUE(Shown(-1.4, 0));
  EXPECT_TRUE(Shown(1, 0));  // beyond the border, not handed over yet
}

TEST_F(ReachTest, SpeedReachesAheadAndOnlyForward) {
  EXPECT_TRUE(Shown(-1.5 - 30 * 4.0 / 60 + 0.1, 30));
  EXPECT_FALSE(Shown(-1.5 - 30 * 4.0 / 60 - 0.1, 30));
  EXPECT_FALSE(Shown(-1.6, -30));
}

TEST_F(ReachTest, ASleeperReachesNoFurtherThanItLies) { EXPECT_FALSE(Shown(-1.6, 30, true)); }

TEST_F(ReachTest, NothingIsPredictedFarInside) {
  Shown(-25, 30);
  EXPECT_FALSE(looked);
}

}  // namespace
}  // namespace tessera::region
