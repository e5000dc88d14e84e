#include "control_plane/world_terms.h"

#include <gtest/gtest.h>

#include "control_plane/change.h"
#include "control_plane/failover.h"
#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

records::Instance Running() {
  records::Instance record;
  record.set_tick_rate_hz(60);
  record.set_game_name("first.lua");
  record.set_game_hash("aa");
  *record.mutable_map() = ToProto(*MakeGridMap({0, 0, 100, 100}, 2));
  record.set_last_map_version(1);
  for (std::uint32_t region : {1u, 2u}) {
    records::Placement& placement = *record.add_placements();
    placement.set_region(region);
    placement.set_incarnation(region);
    placement.set_host_id(region == 1 ? "host-1" : "host-2");
  }
  record.set_last_incarnation(2);
  return record;
}

// The plan is in force, from its tick on.
records::Instance Carried(records::Instance record, std::uint64_t tick) {
  AdoptTerms(record.planned().map(), tick, record);
  record.mutable_map()->Swap(record.mutable_planned()->mutable_map());
  record.clear_planned();
  return record;
}

TEST(WorldTermsTest, NothingIsPlannedForAWorldThatIsAsWanted) {
  EXPECT_FALSE(StepTerms(Running(), true).has_value());
  EXPECT_EQ(PaceOf(Running()), 60);
}

TEST(WorldTermsTest, APauseIsAMapAndItsEndIsNone) {
  records::Instance record = Running();
  record.mutable_clock()->set_paused(true);
  auto planned = StepTerms(record, false);
  ASSERT_TRUE(planned.has_value());
  EXPECT_EQ(planned->planned().map().version(), 2u);
  EXPECT_TRUE(planned->planned().map().terms().paused());
  EXPECT_EQ(planned->planned().map().cells_size(), record.map().cells_size());
  EXPECT_FALSE(StepTerms(*planned, false).has_value()) << "one plan at a time";
  records::Instance paused = Carried(*planned, 700);
  EXPECT_TRUE(IsPaused(paused));
  EXPECT_EQ(PaceOf(paused), 0);
  EXPECT_EQ(DescribeTerms(record, paused, 700), "paused after tick 699");
  EXPECT_FALSE(StepTerms(paused, false).has_value());

  paused.mutable_clock()->set_paused(false);
  const auto resumed = StepTerms(paused, false);
  ASSERT_TRUE(resumed.has_value());
  EXPECT_FALSE(resumed->has_planned());
  EXPECT_EQ(resumed->clock().resumed_version(), 2u);
  EXPECT_FALSE(IsPaused(*resumed));
  EXPECT_FALSE(StepTerms(*resumed, false).has_value());
  records::Instance again = *resumed;
  again.mutable_clock()->set_paused(true);
  const auto second = StepTerms(again, false);
  ASSERT_TRUE(second.has_value()) << "a pause that is over says nothing of the next one";
  EXPECT_EQ(second->planned().map().version(), 3u);
}

// So many facts as the record has regions, all of which stand after `tick`.
std::vector<RegionFacts> StandAfter(std::uint64_t tick, std::uint64_t map_version, std::uint64_t planned_version) {
  std::vector<RegionFacts> facts(2);
  for (RegionFacts& region : facts) {
    region.bound = region.running = true;
    region.tick = tick;
    region.map_version = map_version;
    region.planned_version = planned_version;
  }
  return facts;
}

TEST(WorldTermsTest, AStepIsTheNextPauseWhoseCommitmentEndsThisOne) {
  records::Instance record = Running();
  record.mutable_clock()->set_paused(true);
  const records::Instance paused = Carried(*StepTerms(record, false), 700);
  const records::Instance planned = PlanTicks(paused, 699, 1);
  EXPECT_EQ(planned.planned().map().version(), 3u);
  EXPECT_EQ(planned.planned().effective_tick(), 701u);
  EXPECT_TRUE(planned.planned().map().terms().paused());
  EXPECT_TRUE(IsPaused(planned));
  EXPECT_FALSE(StepTerms(planned, false).has_value());
  EXPECT_FALSE(StepPlan(planned, StandAfter(699, 2, 2)).has_value()) << "it waits for all to know, and is not put off";
  const auto committed = StepPlan(planned, StandAfter(699, 2, 3));
  ASSERT_TRUE(committed.has_value());
  EXPECT_TRUE(committed->planned().committed());
  EXPECT_EQ(committed->clock().resumed_version(), 2u) << "with the same order";
  EXPECT_FALSE(IsPaused(*committed));
  EXPECT_FALSE(StepPlan(*committed, StandAfter(699, 2, 3)).has_value());
  const auto stands = StepPlan(*committed, StandAfter(700, 3, 3));
  ASSERT_TRUE(stands.has_value());
  EXPECT_TRUE(IsPaused(*stands));
  EXPECT_EQ(DescribeTerms(*committed, *stands, 701), "paused after tick 700");
  EXPECT_FALSE(StepTerms(*stands, false).has_value());

  records::Instance goes_on = planned;
  ForgetStep(goes_on);
  EXPECT_FALSE(goes_on.has_planned());
  EXPECT_EQ(goes_on.last_map_version(), 3u) << "nobody takes another map for it";
  goes_on = *committed;
  ForgetStep(goes_on);
  EXPECT_TRUE(goes_on.has_planned()) << "some may make it already";
}

TEST(WorldTermsTest, AFailoverTakesTheTermsOfACommittedPlanAlongAndForgetsOthers) {
  records::Instance record = Running();
  record.mutable_clock()->set_paused(true);
  record.mutable_games()->mutable_next()->set_hash("bb");
  record.mutable_games()->mutable_next()->set_number(1);
  records::Instance planned = *StepTerms(record, true);
  planned.mutable_planned()->set_effective_tick(500);
  const auto cut = [](RegionId, RegionId) { return false; };
  const auto dropped = BeginFailover(planned, {{2, 2, true}}, cut, Now{});
  ASSERT_TRUE(dropped.ok()) << dropped.status();
  EXPECT_FALSE(IsPaused(*dropped));
  EXPECT_EQ(dropped->game_hash(), "aa");
  EXPECT_TRUE(dropped->games().has_next()) << "it is planned anew after the failover";
  planned.mutable_planned()->set_committed(true);
  const auto kept = BeginFailover(planned, {{2, 2, true}}, cut, Now{});
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_TRUE(IsPaused(*kept));
  EXPECT_EQ(kept->map().terms().game(), 1u);
  EXPECT_EQ(kept->game_hash(), "bb");
  EXPECT_FALSE(kept->games().has_next());
}

TEST(WorldTermsTest, ACheckpointNamesTheGameWithWhichTheWorldGoesOn) {
  records::Instance record = Running();
  record.mutable_games()->mutable_next()->set_name("second.lua");
  record.mutable_games()->mutable_next()->set_hash("bb");
  record.mutable_games()->mutable_next()->set_number(1);
  EXPECT_FALSE(StepTerms(record, false).has_value()) << "not all have loaded it";
  records::Instance planned = *StepTerms(record, true);
  planned.mutable_planned()->set_effective_tick(500);
  EXPECT_EQ(GameAfter(planned, 600).hash, "aa") << "it may still come to nothing";
  planned.mutable_planned()->set_committed(true);
  EXPECT_EQ(GameAfter(planned, 498).hash, "aa");
  EXPECT_EQ(GameAfter(planned, 499).hash, "bb");
  EXPECT_EQ(GameAfter(planned, 499).number, 1u);
  const records::Instance now = Carried(planned, 500);
  EXPECT_EQ(now.game_hash(), "bb");
  EXPECT_EQ(now.games().since_tick(), 500u);
  EXPECT_EQ(GameAfter(now, 498).hash, "aa");
  EXPECT_EQ(GameAfter(now, 498).number, 0u);
  EXPECT_EQ(GameAfter(now, 499).hash, "bb");
}

}  // namespace
}  // namespace tessera::control
