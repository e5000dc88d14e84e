#include "region_worker/core/failover_follower.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/region/catalog.h"
#include "region_worker/testing/core_rig.h"

namespace tessera::worker {
namespace {

using ::testing::SizeIs;

// Region 2 has died; its map goes to region 1.
class FailoverFollowerTest : public ::testing::Test {
 protected:
  FailoverFollowerTest() {
    rig.LinkUp(rig.kOther);
    rig.actions.clear();
  }
  absl::StatusOr<bool> Begin(const OrderedFailover& failover, const PartitionMap& map) {
    return failovers.Begin(failover, map, rig.region, copies, rig.links, rig.actions);
  }
  absl::StatusOr<bool> Begin(std::uint64_t version = 2) {
    return Begin({MapVersion(version), {{rig.kOther, Incarnation(1)}}}, MapOfOne(rig.region.map(), version, rig.kSelf));
  }
  static region::Resolution Of(std::uint64_t version) {
    region::Resolution resolution;
    resolution.version = MapVersion(version);
    resolution.resume_tick = Tick(5);
    return resolution;
  }

  CoreRig rig{2};
  StandbyCopies copies{rig.region.catalog()};
  FailoverFollower failovers{{"instance", rig.kSelf, Incarnation(3)}};
};

TEST_F(FailoverFollowerTest, HaltsOnceCutsTheDeadAndSaysWhatIsHeld) {
  EXPECT_TRUE(*Begin());
  EXPECT_TRUE(rig.region.halted());
  EXPECT_TRUE(failovers.under_way());
  EXPECT_THAT(AllOf<CutLink>(rig.actions), SizeIs(1));
  const auto inventory = failovers.InventoryAt(rig.now, copies);
  ASSERT_TRUE(inventory.has_value());
  EXPECT_EQ(inventory->version(), 2U);
  EXPECT_EQ(inventory->owned().bodies_size(), static_cast<int>(rig.region.owned().size()));
  EXPECT_FALSE(*Begin()) << "the same order again";
}

TEST_F(FailoverFollowerTest, TakesPartInTheResolutionOfItsOwnFailoverAlone) {
  EXPECT_FALSE(failovers.TakesPart(Of(2)));
  ASSERT_TRUE(*Begin());
  EXPECT_FALSE(failovers.TakesPart(Of(1)));
  EXPECT_TRUE(failovers.TakesPart(Of(2)));
  failovers.Resumed(Of(2), rig.actions);
  EXPECT_FALSE(failovers.under_way());
  EXPECT_EQ(failovers.InventoryAt(rig.now, copies), std::nullopt);
  EXPECT_FALSE(failovers.TakesPart(Of(2)));
}

TEST_F(FailoverFollowerTest, ANewerFailoverTakesThePlaceOfOneThatIsNotResolved) {
  ASSERT_TRUE(*Begin(2));
  EXPECT_TRUE(*Begin(3));
  EXPECT_FALSE(failovers.TakesPart(Of(2)));
  EXPECT_TRUE(failovers.TakesPart(Of(3)));
}

TEST_F(FailoverFollowerTest, ALifeThatIsDeclaredDeadIsFencedAndDoesNothingMore) {
  const PartitionMap map = MapOfOne(rig.region.map(), 2, rig.kOther);
  EXPECT_FALSE(*Begin({MapVersion(2), {{rig.kSelf, Incarnation(3)}}}, map));
  EXPECT_TRUE(failovers.fenced());
  EXPECT_FALSE(rig.region.halted());
}

TEST_F(FailoverFollowerTest, TheDeathOfAnEarlierLifeOfItsRegionIsNotItsOwn) {
  const PartitionMap map = MapOfOne(rig.region.map(), 2, rig.kOther);
  EXPECT_FALSE(*Begin({MapVersion(2), {{rig.kSelf, Incarnation(2)}}}, map)) << "it has not joined yet";
  EXPECT_FALSE(failovers.fenced());
  EXPECT_FALSE(failovers.under_way());
}

}  // namespace
}  // namespace tessera::worker
