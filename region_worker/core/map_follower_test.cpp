#include "region_worker/core/map_follower.h"

#include <gtest/gtest.h>

#include "region_worker/testing/core_rig.h"

namespace tessera::worker {
namespace {

class MapFollowerTest : public ::testing::Test {
 protected:
  OrderedMap Planned(std::uint64_t version, Tick effective, bool committed) const {
    return {LaterMap(rig.region.map(), version), effective, committed};
  }
  void Follow(const OrderedMap& planned, bool stands = false) { maps.Follow(planned, stands, rig.region, rig.actions); }

  CoreRig rig;
  MapFollower maps{rig.region};
};

TEST_F(MapFollowerTest, AMapIsAnnouncedAndCommittedOnceHoweverOftenItIsOrdered) {
  Follow(Planned(2, Tick(20), false));
  EXPECT_EQ(rig.region.announced(), MapVersion(2));
  EXPECT_FALSE(rig.region.committed());
  EXPECT_EQ(maps.next()->version(), MapVersion(2));
  EXPECT_EQ(maps.planned(rig.region), MapVersion(2));
  Follow(Planned(2, Tick(20), true));
  EXPECT_TRUE(rig.region.committed());
  const std::size_t done = rig.actions.size();
  Follow(Planned(2, Tick(20), true));
  EXPECT_EQ(rig.actions.size(), done);
  EXPECT_EQ(maps.refused(), MapVersion());
}

TEST_F(MapFollowerTest, SaysOnceThatTheMapIsInForce) {
  Follow(Planned(2, Tick(20), true));
  rig.StepTo(Tick(18));
  EXPECT_FALSE(maps.CameIntoForce(rig.region, rig.actions));
  rig.StepTo(Tick(19));
  EXPECT_TRUE(maps.CameIntoForce(rig.region, rig.actions));
  EXPECT_FALSE(maps.CameIntoForce(rig.region, rig.actions));
  EXPECT_EQ(maps.next(), std::nullopt);
  Follow(Planned(2, Tick(20), true));
  EXPECT_EQ(rig.region.announced(), MapVersion());
}

TEST_F(MapFollowerTest, AMapThatComesTooLateIsRefusedUntilItIsOrderedForAnotherTick) {
  rig.StepTo(Tick(10));
  Follow(Planned(2, Tick(11), false));
  Follow(Planned(2, Tick(11), false));
  EXPECT_EQ(maps.refused(), MapVersion(2));
  EXPECT_EQ(rig.Logged(Severity::kWarning), 1);
  Follow(Planned(3, Tick(30), true));
  EXPECT_TRUE(rig.region.committed());
}

TEST_F(MapFollowerTest, ACommitThatComesTooLateIsRefusedOnce) {
  Follow(Planned(2, Tick(20), false));
  rig.StepTo(Tick(19));
  Follow(Planned(2, Tick(20), true));
  Follow(Planned(2, Tick(20), true));
  EXPECT_FALSE(rig.region.committed());
  EXPECT_EQ(maps.refused(), MapVersion(2));
  EXPECT_EQ(rig.Logged(Severity::kWarning), 1);
}

TEST_F(MapFollowerTest, WhereTheWorldStandsAMapIsCommittedHoweverNearItsTickIs) {
  Follow(Planned(2, Tick(20), false));
  rig.StepTo(Tick(18));
  Follow(Planned(2, Tick(20), true), true);
  EXPECT_TRUE(rig.region.committed());
  EXPECT_EQ(maps.refused(), MapVersion());
  EXPECT_EQ(rig.Logged(Severity::kWarning), 0);
}

TEST_F(MapFollowerTest, AFailoversMapTakesThePlaceOfTheAnnouncedOne) {
  Follow(Planned(2, Tick(20), false));
  maps.ForgetNext();
  EXPECT_EQ(maps.next(), std::nullopt);
}

}  // namespace
}  // namespace tessera::worker
