// Planned changes on records and entries alone.
#include "control_plane/cluster/planned_changes.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <string>

#include "control_plane/cluster/views.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Regions 1 and 2 on alpha, which has room for four.
class PlannedChangesTest : public ::testing::Test {
 protected:
  bool Step() {
    const auto next = changes_.Next(instance_, rig_.now);
    return next && rig_.state->StoreInstance(instance_, *next).ok();
  }
  void Store(const absl::StatusOr<std::optional<records::Instance>>& next) {
    ASSERT_TRUE(next.ok() && next->has_value()) << next.status();
    ASSERT_TRUE(rig_.state->StoreInstance(instance_, **next).ok());
  }
  // All workers are as far as the record asks them to be, and those of `linked` have links to each other.
  void AllFollow(const std::set<std::uint32_t>& linked = {1, 2, 3}) {
    const records::Instance& record = instance_.record;
    for (WorkerEntry& worker : instance_.workers) {
      worker.report.clear_linked_regions();
      for (const std::uint32_t other : linked) {
        if (other != worker.region && linked.contains(worker.region)) worker.report.add_linked_regions(other);
      }
      worker.reported_at = rig_.now.steady;
      worker.report.set_phase(v1::WORKER_PHASE_RUNNING);
      worker.report.mutable_address()->set_game_port(1);
      worker.report.set_planned_version(record.planned().map().version());
      const auto& map = record.planned().committed() ? record.planned().map() : record.map();
      worker.report.set_map_version(map.version());
    }
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha", 4);
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &alpha_});
  PlannedChanges changes_{*rig_.state, rig_.settings};
};

TEST_F(PlannedChangesTest, ARegionIsAddedFromThePlanToTheMapInForce) {
  EXPECT_FALSE(Step()) << "all is as wanted";
  Store(changes_.Scale(instance_, 3, rig_.now));
  changes_.Hasten(instance_.number);
  ASSERT_TRUE(Step());  // planned; a newcomer is placed
  ASSERT_EQ(instance_.workers.size(), 3U);
  EXPECT_EQ(instance_.record.planned().effective_tick(), 0U);
  EXPECT_FALSE(Step()) << "waits for the newcomer";
  int steps = 0;
  for (; steps < 20 && (steps == 0 || !AtRest(instance_.record)); ++steps) {
    AllFollow();
    Step();
  }
  EXPECT_TRUE(AtRest(instance_.record));
  EXPECT_EQ(instance_.record.map().regions_size(), 3);
  EXPECT_FALSE(Step()) << "not at once again";
}

TEST_F(PlannedChangesTest, AMapIsCommittedOnceBothEndsOfANewcomersLinksSayThatTheyAreUp) {
  Store(changes_.Scale(instance_, 3, rig_.now));
  ASSERT_TRUE(Step());
  AllFollow({1, 2});
  ASSERT_TRUE(Step());  // a tick for it
  AllFollow({1, 2});
  EXPECT_FALSE(Step()) << "the newcomer has no links";
  EXPECT_EQ(instance_.links_awaited.find("region 3 on alpha has no link to region"), 0u) << instance_.links_awaited;
  EXPECT_NE(ViewOf(*rig_.state, instance_).changes(0).text().find("waits: region 3 on alpha"), std::string::npos);
  for (const std::uint32_t other : {1, 2}) StateRig::WorkerOf(instance_, 3).report.add_linked_regions(other);
  EXPECT_FALSE(Step()) << "its neighbours know of none";
  AllFollow();
  ASSERT_TRUE(Step());
  EXPECT_TRUE(instance_.record.planned().committed());
  EXPECT_EQ(instance_.links_awaited, "");
}

TEST_F(PlannedChangesTest, APlanWhoseNewcomerIsRefusedIsTakenBackAndTriedAgainLater) {
  Store(changes_.Scale(instance_, 3, rig_.now));
  ASSERT_TRUE(Step());
  const auto wait = [&](milliseconds span) {
    for (; span.count() > 0 && instance_.record.has_planned(); span -= milliseconds(250)) {
      AllFollow({1, 2});
      Step();
      rig_.Pass(milliseconds(250));
    }
  };
  wait(kNewcomerLinkPatience);
  ASSERT_TRUE(instance_.record.has_planned()) << "it may only be slow";
  wait(4 * kNewcomerLinkPatience);
  ASSERT_FALSE(instance_.record.has_planned());
  EXPECT_EQ(instance_.record.placements_size(), 2) << "the newcomer ends";
  EXPECT_EQ(instance_.record.map().version(), 1u);
  EXPECT_NE(instance_.record.events().rbegin()->text().find("has no link to region"), std::string::npos);
  EXPECT_NE(ViewOf(*rig_.state, instance_).changes(0).text().find("taken back"), std::string::npos);
  AllFollow({1, 2});
  EXPECT_FALSE(Step()) << "not at once again";
  rig_.Pass(kUnlinkedRetry);
  for (int steps = 0; steps < 20 && (steps == 0 || !AtRest(instance_.record)); ++steps) {
    Step();
    AllFollow();
  }
  EXPECT_EQ(instance_.record.map().regions_size(), 3);
  EXPECT_TRUE(ViewOf(*rig_.state, instance_).changes().empty());
}

TEST_F(PlannedChangesTest, WhatHasNoRoomIsRefusedAndWhatIsSoAlreadyIsNothing) {
  EXPECT_EQ(changes_.Scale(instance_, 5, rig_.now).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_FALSE(changes_.Scale(instance_, 2, rig_.now)->has_value());
  EXPECT_TRUE(changes_.Restart(instance_, rig_.now)->has_value());
}

TEST_F(PlannedChangesTest, AStandbyThatTakesNothingIsCutFromItsPrimaryForAWhile) {
  EXPECT_FALSE(changes_.CutsOf(instance_)(RegionId(1), RegionId(2)));
  const auto pass = [&](milliseconds span) {
    for (; span.count() > 0; span -= milliseconds(500)) {
      rig_.Pass(milliseconds(500));
      for (WorkerEntry& worker : instance_.workers) worker.reported_at = rig_.now.steady;
      (void)changes_.Next(instance_, rig_.now);
    }
  };
  instance_.workers[0].report.set_unprotected(true);
  pass(kStandbyPatience);
  EXPECT_FALSE(changes_.CutsOf(instance_)(RegionId(1), RegionId(2))) << "it may only be slow";
  pass(milliseconds(500));
  EXPECT_TRUE(changes_.CutsOf(instance_)(RegionId(2), RegionId(1)));
  instance_.workers[0].report.set_unprotected(false);
  for (WorkerEntry& worker : instance_.workers) worker.report.add_linked_regions(3 - worker.region);
  pass(kCutKept);
  EXPECT_FALSE(changes_.CutsOf(instance_)(RegionId(1), RegionId(2)));
}

TEST_F(PlannedChangesTest, AChangeThatCameToNothingIsTriedAgainLater) {
  Store(changes_.Scale(instance_, 3, rig_.now));
  changes_.RetryLater(instance_.number, rig_.now);
  EXPECT_FALSE(Step());
  rig_.Pass(kChangeRetry);
  EXPECT_TRUE(Step());
}

}  // namespace
}  // namespace tessera::control
