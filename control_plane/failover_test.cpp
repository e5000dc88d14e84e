// The steps of an instance's record in a failover.
#include "control_plane/failover.h"

#include <gmock/gmock.h>

#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

const CutBetween kNoCuts = [](RegionId, RegionId) { return false; };

// It has handed over all that it had: the map that says so is committed, and not in force yet.
TEST(FailoverTest, WhoACommittedMapLeavesOutMayDieBeforeThatIsInForce) {
  records::Instance record;
  *record.mutable_map() = ToProto(*MakeGridMap({0, 0, 100, 100}, 3));
  *record.mutable_planned()->mutable_map() = ToProto(*MakeGridMap({0, 0, 100, 100}, 2));
  record.mutable_planned()->mutable_map()->set_version(2);
  record.mutable_planned()->set_committed(true);
  for (std::uint32_t region = 1; region <= 3; ++region) {
    records::Placement& placement = *record.add_placements();
    placement.set_region(region);
    placement.set_incarnation(region);
  }
  const auto next = BeginFailover(record, {{3, 3, true}}, kNoCuts, {});
  ASSERT_TRUE(next.ok()) << next.status();
  EXPECT_TRUE(next->planned().committed());  // the others go by it: it cannot be taken back
  EXPECT_FALSE(next->has_failover());
  EXPECT_EQ(next->placements_size(), 2);
}

// Regions 1 and 2, which have a body each, are to be joined by 3, whose map is committed; it dies, and its standby 1
// has nothing of it.
struct Newcomer {
  Newcomer() {
    *record.mutable_map() = ToProto(*MakeGridMap({0, 0, 100, 100}, 2));
    *record.mutable_planned()->mutable_map() = ToProto(*MakeGridMap({0, 0, 100, 100}, 3));
    record.mutable_planned()->mutable_map()->set_version(2);
    for (v1::MapRegion& region : *record.mutable_planned()->mutable_map()->mutable_regions()) {
      region.set_standby(region.id() % 3 + 1);
    }
    record.mutable_planned()->set_committed(true);
    for (std::uint32_t region = 1; region <= 3; ++region) {
      records::Placement& placement = *record.add_placements();
      placement.set_region(region);
      placement.set_incarnation(region);
      placement.set_unprotected(region == 3);
    }
    records::IdRange& bodies = *record.add_bodies();
    bodies.set_first(1);
    bodies.set_last(2);
  }
  absl::StatusOr<records::Instance> Fail() const {
    const auto begun = BeginFailover(record, {{3, 3, true}}, kNoCuts, {});
    if (!begun.ok()) return begun.status();
    Inventories living;
    for (std::uint32_t region = 1; region <= 2; ++region) {
      v1::Inventory& inventory = living[region];
      inventory.set_version(begun->map().version());
      inventory.set_region(region);
      inventory.set_tick(100);
      inventory.mutable_owned()->add_bodies(region);
      inventory.mutable_owned()->add_epochs(1);
    }
    const auto resolution = ResolveFailover(*begun, living);
    if (!resolution.ok()) return resolution.status();
    return WithResolution(*begun, *resolution, {});
  }

  records::Instance record;
};

TEST(FailoverTest, ANewcomerThatDiesBeforeItsStandbyHasACopyHadNothingThatNobodyElseHas) {
  const auto next = Newcomer().Fail();
  ASSERT_TRUE(next.ok()) << next.status();
  EXPECT_EQ(next->failover().dead(0).standby(), 1U);
  EXPECT_EQ(next->lost_bodies(), 0U);
  EXPECT_FALSE(next->has_lost_time());
}

TEST(FailoverTest, OfANewcomerNobodyHasACopyAndABodyIsMissing) {
  Newcomer setup;
  setup.record.mutable_bodies(0)->set_last(3);
  EXPECT_EQ(setup.Fail().status().code(), absl::StatusCode::kDataLoss);
}

TEST(FailoverTest, OfWhoIsNoNewcomerThereMustBeACopy) {
  Newcomer setup;
  setup.record.mutable_placements(2)->set_unprotected(false);
  EXPECT_EQ(setup.Fail().status().code(), absl::StatusCode::kDataLoss);
}

TEST(FailoverTest, ANewcomerMayDieTogetherWithItsStandby) {
  Newcomer setup;
  setup.record.mutable_map()->mutable_regions(0)->set_standby(2);
  EXPECT_TRUE(BeyondFailover(setup.record, {{1, 1, true}, {3, 3, true}}).empty());
  setup.record.mutable_placements(2)->set_unprotected(false);
  EXPECT_THAT(BeyondFailover(setup.record, {{1, 1, true}, {3, 3, true}}), testing::ElementsAre(3U));
}

}  // namespace
}  // namespace tessera::control
