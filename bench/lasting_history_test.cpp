// The judge of histories: each kind of violation is found, and what only looks like one is not.
#include "bench/lasting_history.h"

#include <gmock/gmock.h>

namespace tessera::bench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

ChangeRecord Change(const std::string& name, bool added, bool acknowledged) {
  return {.name = name, .added = added, .asked = 1, .acknowledged = acknowledged, .answered = 2};
}

TEST(LastingHistoryTest, WhatWasAcknowledgedMustBeThere) {
  const std::vector<ChangeRecord> changes{
      Change("kept", true, true),  Change("lost", true, true), Change("maybe", true, false), Change("gone", true, true),
      Change("gone", false, true), Change("back", true, true), Change("back", false, true)};
  EXPECT_THAT(LostChanges(changes, {"kept", "back"}),
              ElementsAre(HasSubstr("the removal of back"), HasSubstr("the addition of lost")));
  EXPECT_THAT(LostChanges(changes, {"kept", "lost", "maybe"}), IsEmpty());
}

TEST(LastingHistoryTest, ARemovalWithoutAnAnswerMayHaveHappened) {
  const std::vector<ChangeRecord> changes{Change("w", true, true), Change("w", false, false)};
  EXPECT_THAT(LostChanges(changes, {}), IsEmpty());
  EXPECT_THAT(LostChanges(changes, {"w"}), IsEmpty());
}

TEST(LastingHistoryTest, ABackupKnowsWhatWasAcknowledgedBeforeIt) {
  // Each change was asked for at 1 s and acknowledged at 2 s.
  const std::vector<ChangeRecord> changes{Change("kept", true, true), Change("lost", true, true)};
  EXPECT_THAT(LostChanges(changes, {"kept"}, {{.from = 3, .to = 9}}), ElementsAre(HasSubstr("the addition of lost")));
  EXPECT_THAT(LostChanges(changes, {"kept"}, {{.from = 1.5, .to = 9}}), IsEmpty());
  EXPECT_THAT(LostChanges(changes, {"kept"}, {{.from = 0.1, .to = 0.5}}), SizeIs(1)) << "it came after the backup did";
}

TEST(LastingHistoryTest, WhatAChangeOfBeforeABackupDidMayBeBack) {
  std::vector<ChangeRecord> changes{Change("w", true, true), Change("w", false, true)};
  changes.back().asked = 4;
  changes.back().answered = 5;
  EXPECT_THAT(LostChanges(changes, {"w"}), SizeIs(1));
  EXPECT_THAT(LostChanges(changes, {"w"}, {{.from = 3, .to = 9}}), IsEmpty());
  EXPECT_THAT(LostChanges(changes, {}, {{.from = 3, .to = 9}}), IsEmpty());
}

TEST(LastingHistoryTest, ADeposedLeaderMustNotWrite) {
  EXPECT_THAT(TwoWriters({{11, 10}, {12, 10}, {21, 20}, {22, 20}}), IsEmpty());
  EXPECT_THAT(TwoWriters({{11, 10}, {21, 20}, {22, 10}}), ElementsAre(HasSubstr("revision 22 is of leader 10")));
  EXPECT_THAT(TwoWriters({{11, 12}}), ElementsAre(HasSubstr("not elected yet")));
}

StepRecord Reading(const std::string& worker, std::uint32_t region, double at, std::uint64_t tick, std::uint64_t map) {
  return {.worker = worker, .region = region, .at = at, .steps = tick, .tick = tick, .map = map};
}

TEST(LastingHistoryTest, ADeadWorkerAndItsSuccessorAreOneOwner) {
  EXPECT_THAT(
      TwoOwners({Reading("old", 1, 0.0, 100, 4), Reading("old", 1, 0.1, 106, 4), Reading("old", 1, 0.2, 110, 4),
                 // It died ahead of what its standby had; the steps between are made again.
                 Reading("new", 2, 1.0, 108, 5), Reading("new", 2, 1.1, 114, 5), Reading("new", 2, 1.2, 120, 5)}),
      IsEmpty());
}

TEST(LastingHistoryTest, WhoStepsOnByAnOldMapOwnsTwice) {
  const std::vector<StepRecord> steps{Reading("old", 1, 0.0, 100, 4), Reading("new", 2, 1.0, 108, 5),
                                      Reading("old", 1, 1.1, 112, 4), Reading("old", 1, 1.2, 118, 4),
                                      Reading("old", 1, 1.3, 124, 4)};
  EXPECT_THAT(TwoOwners(steps), ElementsAre(HasSubstr("old stepped to tick 118 by map 4")));
}

TEST(LastingHistoryTest, WhoStandsStillByAnOldMapDoesNot) {
  EXPECT_THAT(TwoOwners({Reading("old", 1, 0.0, 100, 4), Reading("new", 2, 1.0, 108, 5), Reading("old", 1, 1.1, 100, 4),
                         Reading("old", 1, 1.2, 100, 4), Reading("old", 1, 1.3, 100, 4)}),
              IsEmpty());
}

TEST(LastingHistoryTest, WhoWaitsForTheTickOfALaterMapOwnsNothingYet) {
  std::vector<StepRecord> steps{Reading("new", 2, 1.0, 0, 5),   Reading("old", 1, 1.1, 106, 4),
                                Reading("old", 1, 1.2, 112, 4), Reading("old", 1, 1.3, 118, 4),
                                Reading("old", 1, 1.4, 124, 5), Reading("new", 2, 1.4, 124, 5)};
  EXPECT_THAT(TwoOwners(steps), IsEmpty());
  steps.front() = Reading("new", 2, 1.0, 100, 5);
  EXPECT_THAT(TwoOwners(steps), ElementsAre(HasSubstr("old stepped to tick 112 by map 4")));
}

TEST(LastingHistoryTest, AChangeOfMapsAtOneTickIsNoViolation) {
  EXPECT_THAT(TwoOwners({Reading("a", 1, 0.00, 100, 4), Reading("b", 2, 0.01, 101, 5), Reading("a", 1, 0.05, 102, 5),
                         Reading("a", 1, 0.10, 106, 5)}),
              IsEmpty());
}

ClaimRecord Claim(double asked, bool running, std::vector<std::uint32_t> regions, const std::string& reason = "") {
  return {.asked = asked, .running = running, .degraded = !running, .reason = reason, .regions = std::move(regions)};
}

TEST(LastingHistoryTest, RunningWhileARegionStandsStillIsALie) {
  const Stalls stalls{{2, {{10, 14}}}};
  const std::vector<ClaimRecord> claims{Claim(8, true, {1, 2}),  Claim(10.5, true, {1, 2}), Claim(11.5, false, {1, 2}),
                                        Claim(12, true, {1, 2}), Claim(13, true, {1, 3}),   Claim(15, true, {1, 2}),
                                        Claim(16, true, {1, 2})};
  const Falsehood lies = FalseRunning(claims, stalls);
  EXPECT_DOUBLE_EQ(lies.total_s, 2);  // 10.5 to 11.5, 12 to 13
  EXPECT_DOUBLE_EQ(lies.longest_s, 1);
  EXPECT_THAT(lies.told, SizeIs(2));
  EXPECT_DOUBLE_EQ(lies.Between(0, 20), lies.total_s);
  EXPECT_DOUBLE_EQ(lies.Between(11, 12.25), 0.75);  // 11 to 11.5, 12 to 12.25
  EXPECT_DOUBLE_EQ(lies.Between(14, 20), 0);
}

TEST(LastingHistoryTest, DegradedWhileAllStepIsToldUnlessAStandbyIsMissing) {
  const Stalls stalls{{2, {{10, 14}}}};
  const std::vector<ClaimRecord> claims{Claim(9, false, {1, 2}, "host beta is silent: region 2"),
                                        Claim(10, false, {1, 2}, "no steps are known of region 2"),
                                        Claim(15, false, {1, 2}, "region 1: it has no standby"),
                                        Claim(16, true, {1, 2})};
  EXPECT_DOUBLE_EQ(FalseDegraded(claims, stalls).total_s, 1);
}

// Region 1 runs on alpha, 2 on beta or, once it has moved, on gamma.
ClaimRecord ClaimOfBorder(double asked, bool running, const std::string& host_of_two, const std::string& reason = "") {
  ClaimRecord claim = Claim(asked, running, {1, 2}, reason);
  claim.borders = {{.one = 1, .other = 2, .host_of_one = "alpha", .host_of_other = host_of_two}};
  return claim;
}
const HostCut kCutOfTest{.one = "beta", .other = "alpha", .from = 10, .to = 40};

TEST(LastingHistoryTest, ACutIsToldWhereItsNeighboursAreNamedAndOverWhereOneHasMoved) {
  const std::vector<ClaimRecord> claims{ClaimOfBorder(9, true, "beta"),
                                        ClaimOfBorder(12, true, "beta"),
                                        ClaimOfBorder(15, false, "beta", "regions 2 and 3 have no link"),
                                        ClaimOfBorder(16, false, "beta", "regions 1 and 2 have no link"),
                                        ClaimOfBorder(25, false, "gamma", "failover of region 2 to region 3"),
                                        ClaimOfBorder(27, true, "gamma"),
                                        ClaimOfBorder(50, true, "beta")};
  const CutOutcome outcome = OutcomeOf(claims, kCutOfTest, 5);
  EXPECT_DOUBLE_EQ(outcome.degraded_s, 6);
  EXPECT_DOUBLE_EQ(outcome.routed_s, 17);
  EXPECT_DOUBLE_EQ(outcome.false_running_s, 0) << "nobody can know it at once";
  EXPECT_TRUE(outcome.told());
}

TEST(LastingHistoryTest, RunningWithNeighboursThatHaveLongBeenCutIsALie) {
  const std::vector<ClaimRecord> claims{ClaimOfBorder(9, true, "beta"), ClaimOfBorder(14, true, "beta"),
                                        ClaimOfBorder(20, false, "beta", "no steps are known of region 2"),
                                        ClaimOfBorder(30, true, "beta"), ClaimOfBorder(45, true, "beta")};
  const CutOutcome outcome = OutcomeOf(claims, kCutOfTest, 5);
  EXPECT_FALSE(outcome.told());
  EXPECT_DOUBLE_EQ(outcome.false_running_s, 5 + 10);  // 15 to 20, and 30 until it was mended
}

TEST(LastingHistoryTest, AMissingLinkIsTrueWhileHostsAreCutAndNotLongAfter) {
  const std::vector<ClaimRecord> claims{
      ClaimOfBorder(20, false, "beta", "regions 1 and 2 have no link"),
      ClaimOfBorder(30, false, "beta", "host beta is silent: region 2"), ClaimOfBorder(31, true, "beta"),
      ClaimOfBorder(41, false, "beta", "regions 1 and 2 have no link"), ClaimOfBorder(43, true, "beta")};
  EXPECT_DOUBLE_EQ(FalseDegraded(claims, {}, {kCutOfTest}).total_s, 1 + 2);
  EXPECT_DOUBLE_EQ(FalseDegraded(claims, {}).total_s, 10 + 1 + 2);
}

TEST(LastingHistoryTest, AStallIsTimeWithoutSteps) {
  std::vector<StepRecord> steps{Reading("w", 1, 0, 0, 1), Reading("w", 1, 1, 60, 1), Reading("w", 1, 2, 60, 1),
                                Reading("w", 1, 4, 61, 1), Reading("w", 1, 4.2, 73, 1)};
  const Stalls still = StallsOf(steps, 4.3, 0.5);
  ASSERT_THAT(still.at(1), SizeIs(1));
  EXPECT_DOUBLE_EQ(still.at(1)[0].from, 1);
  EXPECT_DOUBLE_EQ(still.at(1)[0].to, 4);
  // Nobody looked for 3 s, and it had made its ticks all the same.
  steps.push_back(Reading("w", 1, 7.2, 253, 1));
  EXPECT_THAT(StallsOf(steps, 7.3, 0.5).at(1), SizeIs(1));
  // Nothing was heard of it any more, and then another one was its worker.
  steps.push_back(Reading("x", 1, 9.2, 12, 2));
  EXPECT_THAT(StallsOf(steps, 9.3, 0.5).at(1), SizeIs(2));
  EXPECT_DOUBLE_EQ(StallsOf(steps, 12, 0.5).at(1).back().to, 12) << "until the end";
}

History TakenOverAndGivenBack() {
  History history;
  // Region 1 dies, region 2 takes its place by map 5, and gives it back by map 6 two seconds later.
  history.claims = {Claim(9, true, {1, 2}), Claim(10.3, true, {2}), Claim(12.5, true, {1, 2})};
  for (std::size_t i = 0; i < 3; ++i) history.claims[i].map = 4 + i;
  history.steps = {Reading("old", 1, 9.9, 590, 4),   Reading("two", 2, 9.9, 590, 4),  Reading("two", 2, 10.1, 600, 4),
                   Reading("two", 2, 10.35, 600, 5), Reading("two", 2, 10.4, 603, 5), Reading("new", 1, 12.3, 0, 5),
                   Reading("two", 2, 12.4, 723, 6),  Reading("new", 1, 12.6, 3, 6)};
  return history;
}

TEST(LastingHistoryTest, AWorldGoesOnOnceAllOfALaterMapStep) {
  History history = TakenOverAndGivenBack();
  EXPECT_EQ(AllStepped(history, 10, 5), 10.4) << "whoever has a map and makes no step by it stands still";
  EXPECT_EQ(AllStepped(history, 10, 6), 12.6) << "a new worker has begun once it makes a step";
  EXPECT_EQ(AllStepped(history, 10, 7), std::nullopt);
  EXPECT_EQ(AllStepped(history, 12.5, 5), std::nullopt) << "nothing is known of region 2 since";
}

TEST(LastingHistoryTest, AMapThatNobodySaidIsNotWaitedFor) {
  History history = TakenOverAndGivenBack();
  std::erase_if(history.claims, [](const ClaimRecord& claim) { return claim.map == 5; });
  EXPECT_EQ(AllStepped(history, 10, 5), 12.6) << "the next one that was said";
  history.claims.clear();
  EXPECT_EQ(AllStepped(history, 10, 5), std::nullopt);
}

}  // namespace
}  // namespace tessera::bench
