// Which region goes for a link that stays cut, by what is known of the world alone.
#include "control_plane/cluster/cut_links.h"

#include <gmock/gmock.h>

#include "control_plane/standbys.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

// Regions 1 to 4 of a grid of two by two, where each borders on each, on four hosts; two more hosts are free.
class CutLinksTest : public ::testing::Test {
 protected:
  CutLinksTest() {
    for (WorkerEntry& worker : instance_.workers) worker.report.set_owned(100);
  }
  // These pairs of regions have had no link since now.
  void Cut(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
    instance_.cut_links.clear();
    for (const auto& [one, other] : pairs) instance_.cut_links.push_back({one, other, rig_.now.steady});
  }
  // So long after the link was cut; all workers report.
  CutDecision After(milliseconds span) {
    rig_.Pass(span);
    for (WorkerEntry& worker : instance_.workers) worker.reported_at = rig_.now.steady;
    return links_.Look(instance_, free_, rig_.now);
  }
  CutDecision AfterAll() { return After(kCutAfter + rig_.settings.move_cut_after); }
  void MoveInto(const records::Instance& next) { ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok()); }

  StateRig rig_;
  HostEntry &alpha_ = rig_.AddHost("alpha"), &beta_ = rig_.AddHost("beta"), &gamma_ = rig_.AddHost("gamma"),
            &delta_ = rig_.AddHost("delta"), &spare_ = rig_.AddHost("spare");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &beta_, &gamma_, &delta_});
  std::vector<FreeHost> free_ = {{spare_.record.id(), 4}};
  CutLinks links_{*rig_.state, rig_.settings};
};

TEST_F(CutLinksTest, OneOfTwoRegionsGoesOnceTheirLinkHasBeenCutForLongEnough) {
  Cut({{1, 2}});
  StateRig::WorkerOf(instance_, 2).report.set_owned(50);
  const CutDecision before = After(kCutAfter + rig_.settings.move_cut_after - milliseconds(1));
  EXPECT_FALSE(before.move.has_value());
  EXPECT_EQ(before.stuck, "") << "it may come back";
  const CutDecision due = After(milliseconds(1));
  ASSERT_TRUE(due.move.has_value());
  EXPECT_EQ(due.move->region, 2U) << "it has fewer bodies";
  EXPECT_EQ(due.move->what, "region 1 on alpha and region 2 on beta have no link");
  EXPECT_THAT(due.move->shunned, ElementsAre(beta_.record.id()));
  EXPECT_EQ(due.stuck, "");
}

TEST_F(CutLinksTest, ACutThatHealsEarlierMovesNobody) {
  Cut({{1, 2}});
  After(kCutAfter + rig_.settings.move_cut_after - milliseconds(100));
  Cut({});
  EXPECT_FALSE(After(seconds(60)).move.has_value());
}

TEST_F(CutLinksTest, TheTimeIsAsTheOperatorSetsIt) {
  rig_.settings.move_cut_after = seconds(60);
  CutLinks patient(*rig_.state, rig_.settings);
  Cut({{1, 2}});
  After(seconds(64));
  EXPECT_FALSE(patient.Look(instance_, free_, rig_.now).move.has_value());
  After(seconds(1));
  EXPECT_TRUE(patient.Look(instance_, free_, rig_.now).move.has_value());
}

TEST_F(CutLinksTest, TheRegionWithMostCutLinksGoesHoweverManyBodiesItHas) {
  Cut({{1, 3}, {2, 3}});
  StateRig::WorkerOf(instance_, 3).report.set_owned(5000);
  const CutDecision due = AfterAll();
  ASSERT_TRUE(due.move.has_value());
  EXPECT_EQ(due.move->region, 3U);
}

TEST_F(CutLinksTest, OfTwoCutsAtOneHostARegionOfThatHostGoes) {
  InstanceEntry& shared = rig_.AddRunning({&alpha_, &beta_, &gamma_, &gamma_});
  shared.cut_links = {{1, 3, rig_.now.steady}, {2, 4, rig_.now.steady}};
  for (WorkerEntry& worker : shared.workers) worker.report.set_owned(worker.region > 2 ? 900 : 10);
  StateRig::WorkerOf(shared, 4).report.set_owned(800);
  rig_.Pass(seconds(10));
  for (WorkerEntry& worker : shared.workers) worker.reported_at = rig_.now.steady;
  const CutDecision due = links_.Look(shared, free_, rig_.now);
  ASSERT_TRUE(due.move.has_value());
  EXPECT_EQ(due.move->region, 4U) << "the smaller one of those on gamma";
}

TEST_F(CutLinksTest, AHostFromWhichALinkToANeighbourIsKnownToBeCutIsNoBetter) {
  Cut({{1, 2}, {1, 3}});
  free_ = {{beta_.record.id(), 4}, {gamma_.record.id(), 4}, {delta_.record.id(), 4}};
  const CutDecision due = AfterAll();
  ASSERT_TRUE(due.move.has_value());
  EXPECT_EQ(due.move->region, 1U);
  // On beta or gamma region 1 would be beside regions 2 and 3, whose hosts alone are cut from alpha, and not from
  // there.
  EXPECT_THAT(due.move->shunned, UnorderedElementsAre(alpha_.record.id()));
  // From beta there is no link to gamma any more, where a neighbour lives.
  Cut({{1, 2}, {1, 3}, {2, 3}});
  const CutDecision all = AfterAll();
  ASSERT_TRUE(all.move.has_value());
  EXPECT_EQ(all.move->region, 1U);
  EXPECT_THAT(all.move->shunned, UnorderedElementsAre(alpha_.record.id(), beta_.record.id(), gamma_.record.id()));
}

TEST_F(CutLinksTest, WithoutRoomForTheOneTheOtherGoes) {
  Cut({{1, 2}});
  StateRig::WorkerOf(instance_, 1).report.set_owned(10);
  free_ = {{alpha_.record.id(), 1}};  // region 1 is there already
  const CutDecision due = AfterAll();
  ASSERT_TRUE(due.move.has_value());
  EXPECT_EQ(due.move->region, 2U);
}

TEST_F(CutLinksTest, WithoutRoomForEitherItSaysWhatToDoAndSaysItOnce) {
  Cut({{1, 2}});
  free_ = {{spare_.record.id(), 0}, {alpha_.record.id(), 0}};
  const CutDecision due = AfterAll();
  EXPECT_FALSE(due.move.has_value());
  EXPECT_EQ(due.stuck,
            "region 1 on alpha and region 2 on beta have no link, and no other host has room for either: add a host, "
            "or let UDP through between alpha and beta");
  EXPECT_TRUE(links_.IsNews(instance_.number, due.stuck));
  EXPECT_FALSE(links_.IsNews(instance_.number, due.stuck));
  EXPECT_FALSE(links_.IsNews(instance_.number, "")) << "it is over";
  EXPECT_TRUE(links_.IsNews(instance_.number, due.stuck)) << "and here again";
}

TEST_F(CutLinksTest, AHostThatIsAvoidedHasNoRoom) {
  Cut({{1, 2}});
  free_.front().avoided = true;
  EXPECT_THAT(AfterAll().stuck, HasSubstr("no other host has room for either"));
}

TEST_F(CutLinksTest, AnEndThatDoesNotReportIsNotMovedForItsLink) {
  Cut({{1, 2}});
  AfterAll();
  StateRig::WorkerOf(instance_, 2).reported_at = rig_.now.steady - kStillAfter;
  const CutDecision due = links_.Look(instance_, free_, rig_.now);
  EXPECT_FALSE(due.move.has_value());
  EXPECT_EQ(due.stuck, "") << "that it is silent is told otherwise";
}

TEST_F(CutLinksTest, OneRegionGoesInTenMinutesAndItsHostIsAvoidedMeanwhile) {
  Cut({{1, 2}});
  ASSERT_EQ(AfterAll().move->region, 1U);
  links_.NoteMoved(instance_, 1, rig_.now);
  EXPECT_TRUE(links_.Avoids(instance_.number, alpha_.record.id(), rig_.now));
  EXPECT_FALSE(links_.Avoids(instance_.number, beta_.record.id(), rig_.now));
  EXPECT_TRUE(After(seconds(1)).move.has_value()) << "it is there still: the plan came to nothing";
  records::Instance next = instance_.record;
  next.mutable_placements(0)->set_incarnation(77);
  MoveInto(next);
  instance_.workers[0].report.set_phase(v1::WORKER_PHASE_RUNNING);
  Cut({{1, 2}});
  const CutDecision again = AfterAll();
  EXPECT_FALSE(again.move.has_value());
  EXPECT_THAT(again.stuck, HasSubstr("less than ten minutes ago: let UDP through between alpha and beta"));
  EXPECT_TRUE(After(kMovedRegionInterval).move.has_value());
  EXPECT_FALSE(links_.Avoids(instance_.number, alpha_.record.id(), rig_.now));
}

// --- A change that waits for the link.

// Region 4 leaves: region 3 has its cells, and may not have all of its bodies yet.
class HoldingUpTest : public CutLinksTest {
 protected:
  HoldingUpTest() {
    records::Instance next = instance_.record;
    v1::PartitionMap& map = *next.mutable_map();
    map.set_version(2);
    for (v1::Cell& cell : *map.mutable_cells()) {
      if (cell.owner() != 4) continue;
      cell.set_owner(3);
      cell.set_from(4);
    }
    MoveInto(next);
    for (WorkerEntry& worker : instance_.workers) worker.report.set_map_version(2);
    StateRig::WorkerOf(instance_, 4).report.set_bodies_outside(3);
    // A standby that hears it.
    standby_ = StandbyOf(instance_.record, 4);
    Cut({{std::min(4U, Other()), std::max(4U, Other())}});
    instance_.cut_links.front().since -= kCutAfter + rig_.settings.move_cut_after;
  }
  // The first of the others that is not its standby.
  std::uint32_t Other() const { return standby_ == 1 ? 2 : 1; }
  std::optional<std::uint32_t> For(milliseconds span) {
    std::optional<std::uint32_t> holding;
    for (milliseconds passed{0}; passed <= span; passed += milliseconds(100)) {
      for (WorkerEntry& worker : instance_.workers) worker.reported_at = rig_.now.steady;
      holding = links_.HoldingUp(instance_, rig_.now);
      rig_.Pass(milliseconds(100));
    }
    return holding;
  }
  std::uint32_t standby_ = 0;
};

TEST_F(HoldingUpTest, ARegionThatLeavesIsCarriedOnOnceItsLinkHoldsItUpForLongEnough) {
  EXPECT_EQ(For(kCutChangePatience - milliseconds(100)), std::nullopt);
  EXPECT_EQ(For(milliseconds(0)), std::optional(4U));
}

TEST_F(HoldingUpTest, ThatItHasHandedOverAllBeginsItAnew) {
  EXPECT_EQ(For(kCutChangePatience - milliseconds(100)), std::nullopt);
  StateRig::WorkerOf(instance_, 4).report.set_bodies_outside(0);
  EXPECT_EQ(For(milliseconds(0)), std::nullopt);
  StateRig::WorkerOf(instance_, 4).report.set_bodies_outside(1);
  EXPECT_EQ(For(kCutChangePatience - milliseconds(100)), std::nullopt);
}

TEST_F(HoldingUpTest, NobodyIsCarriedOnWhoseStandbyDoesNotHaveAllOfIt) {
  WorkerEntry& leaver = StateRig::WorkerOf(instance_, 4);
  leaver.report.set_unprotected(true);
  EXPECT_EQ(For(2 * kCutChangePatience), std::nullopt);
  leaver.report.set_unprotected(false);
  EXPECT_EQ(For(kCutChangePatience), std::optional(4U));
  StateRig::WorkerOf(instance_, standby_).report.clear_standby_copies();
  EXPECT_EQ(For(2 * kCutChangePatience), std::nullopt);
}

TEST_F(HoldingUpTest, WithoutACutLinkOrAfterAllWasSettledThereIsNothingToWaitFor) {
  const std::vector<CutLink> links = instance_.cut_links;
  instance_.cut_links.clear();
  EXPECT_EQ(For(2 * kCutChangePatience), std::nullopt);
  instance_.cut_links = links;
  records::Instance next = instance_.record;
  for (v1::Cell& cell : *next.mutable_map()->mutable_cells()) cell.set_from(0);
  MoveInto(next);
  EXPECT_EQ(For(2 * kCutChangePatience), std::nullopt);
}

}  // namespace
}  // namespace tessera::control
