// Several control planes on one store, under faults of leaders and of the store: the product's control plane, agents
// and workers in virtual time.
#include "tests/simulation/leader_scenario.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "tests/simulation/deployed_world.h"
#include "tests/simulation/world_watch.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr Micros kPatience = Milliseconds(10'000);

class LeaderTest : public QuietTest {};

struct LedWorld : DeployedWorld {
  explicit LedWorld(std::uint64_t seed = 1, std::uint32_t controls = 3)
      : DeployedWorld({.seed = seed, .hosts = 3, .regions = 3, .controls = controls}, MomentOf(seed), 30),
        watch(deployment, kLeaderBounds) {
    watch.sees = [this](const SimulatedControl& control) { return IsHeardBy(control); };
  }
  SimulatedControl& leader() { return deployment.control(); }
  // Another one than `before` leads, and has heard all hosts.
  bool AwaitNext(const SimulatedControl& before) {
    return watch.RunUntil(kPatience, [&] { return &leader() != &before && leader().leads() && Heard(); });
  }
  bool Heard() const { return IsHeardBy(deployment.control()); }
  bool IsHeardBy(const SimulatedControl& control) const {
    for (std::uint32_t host = 1; host <= 3; ++host) {
      if (deployment.HostAt(host).attached_to() != control.number()) return false;
    }
    return true;
  }
  bool Acknowledges(SimulatedControl& asked, const std::string& name) {
    v1::CreateTokenRequest request;
    request.set_name(name);
    request.set_role(v1::ROLE_VIEWER);
    return asked.Call(
        [&](control::Cluster& cluster, control::Now now) { return cluster.CreateToken(now, request).ok(); });
  }
  bool Knows(const std::string& name) { return leader().cluster().tokens().Named(name) != nullptr; }
  void ExpectTruth() {
    ExpectWhole();
    EXPECT_THAT(watch.words().problems(), IsEmpty());
    EXPECT_EQ(deployment.totals().two_owners, 0U);
  }

  WorldWatch watch;
};

TEST_F(LeaderTest, OneOfThreeLeadsAndAllAgentsFindIt) {
  LedWorld run;
  EXPECT_EQ(std::ranges::count_if(run.deployment.controls(), [](const auto& control) { return control->alive(); }), 1);
  EXPECT_TRUE(run.Heard());
  run.ExpectTruth();
}

TEST_F(LeaderTest, WhatAKilledLeaderAcknowledgedTheNextOneHasAndTheWorldRunsOn) {
  LedWorld run;
  SimulatedControl& first = run.leader();
  ASSERT_TRUE(run.Acknowledges(first, "kept"));
  const Tick before = run.deployment.tick();
  first.Kill();
  ASSERT_TRUE(run.AwaitNext(first)) << run.deployment.Standing();
  EXPECT_TRUE(run.Knows("kept"));
  ASSERT_EQ(run.watch.leader_gaps().size(), 1U);
  EXPECT_LE(run.watch.leader_gaps().front(), kElectionTtl + 2 * kElectionPoll);
  EXPECT_GE(run.deployment.tick() - before,
            static_cast<std::int64_t>(run.watch.leader_gaps().front() * 59 / 1'000'000));
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  first.Start();
  run.ExpectTruth();
}

TEST_F(LeaderTest, AWorkerThatDiesWhileNobodyLeadsIsCarriedOnByTheNextLeader) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    LedWorld run(seed);
    SimulatedControl& first = run.leader();
    first.Kill();
    run.watch.RunFor(Milliseconds(500));
    run.deployment.Kill(RegionId(2));
    ASSERT_TRUE(run.AwaitNext(first)) << run.deployment.Standing();
    run.watch.RunFor(Milliseconds(2000));
    EXPECT_EQ(run.deployment.totals().takeovers, 1U) << run.deployment.Standing();
    run.ExpectTruth();
  }
}

// It comes back with messages that waited for it, and a lease that is over.
TEST_F(LeaderTest, ALeaderThatWasStoppedForLongerThanItsLeaseChangesNothingWhenItComesBack) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    LedWorld run(seed);
    SimulatedControl& first = run.leader();
    first.SetStopped(true);
    ASSERT_TRUE(run.AwaitNext(first)) << run.deployment.Standing();
    ASSERT_TRUE(run.Acknowledges(run.leader(), "by-the-next"));
    run.watch.RunFor(Milliseconds(1000));
    first.SetStopped(false);
    EXPECT_FALSE(first.alive()) << "it follows";
    run.watch.RunFor(Milliseconds(2000));
    EXPECT_TRUE(run.Knows("by-the-next"));
    EXPECT_EQ(run.deployment.totals().takeovers, 0U);
    run.ExpectTruth();
  }
}

TEST_F(LeaderTest, ALeaderThatIsCutOffFromTheStoreAcknowledgesNothing) {
  LedWorld run;
  SimulatedControl& first = run.leader();
  run.deployment.network().Cut(first.node(), kStoreNode, true);
  ASSERT_TRUE(first.alive()) << "it does not know yet";
  EXPECT_FALSE(run.Acknowledges(first, "lost"));
  ASSERT_TRUE(run.AwaitNext(first)) << run.deployment.Standing();
  EXPECT_FALSE(run.Knows("lost"));
  run.ExpectTruth();
}

// The worker's lease is renewed by one who does not lead for much longer.
TEST_F(LeaderTest, AWorkerThatIsCutOffTogetherWithADeposedLeaderStepsBesideNobody) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    LedWorld run(seed);
    SimulatedControl& first = run.leader();
    const std::uint32_t host = run.deployment.Find(RegionId(2))->place();
    run.deployment.network().MovePlace(PlaceOfControl(first.number()), 1);
    run.deployment.network().MovePlace(host, 1);
    run.watch.RunFor(Milliseconds(9000));
    EXPECT_FALSE(first.alive());
    EXPECT_GE(run.deployment.totals().takeovers, 1U) << run.deployment.Standing();
    EXPECT_EQ(run.deployment.totals().two_owners, 0U);
    EXPECT_EQ(run.watch.words().two_owners(), 0U);
    run.ExpectTruth();
  }
}

// Each time at another moment between two renewals, and up to 60 ms before the cut. By its own count the leader's lease
// has up to 3.6 s left.
TEST_F(LeaderTest, AWorkerThatIsCutOffTogetherWithALeaderWhoseLeaseWasRevokedEarlyStepsBesideNobody) {
  constexpr std::uint64_t kTimes = 20;
  std::uint64_t unaware = 0;
  for (std::uint64_t seed = 1; seed <= kTimes; ++seed) {
    SCOPED_TRACE(seed);
    LedWorld run(seed);
    SimulatedControl& first = run.leader();
    run.watch.RunFor(seed * kRenewAfter / kTimes);
    const std::uint32_t host = run.deployment.Find(RegionId(2))->place();
    run.deployment.store().RevokeEarly();
    run.watch.RunFor(seed % 4 * Milliseconds(20));
    unaware += first.alive() ? 1 : 0;
    run.deployment.network().MovePlace(PlaceOfControl(first.number()), 1);
    run.deployment.network().MovePlace(host, 1);
    run.watch.RunFor(Milliseconds(9000));
    EXPECT_GE(run.deployment.totals().takeovers, 1U) << run.deployment.Standing();
    EXPECT_EQ(run.deployment.totals().two_owners, 0U);
    EXPECT_EQ(run.watch.words().two_owners(), 0U);
    run.ExpectTruth();
  }
  EXPECT_GE(unaware, kTimes / 2);
}

// Its standby is cut off from it, so it lives by the leader alone.
TEST_F(LeaderTest, AWorkerThatOnlyTheLeaderRenewsStepsOnWhileTheStoreIsSlow) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    LedWorld run(seed);
    SimulatedWorker* const worker = run.deployment.Find(RegionId(2));
    const SimulatedWorker* const standby = run.deployment.Find(worker->order().standby);
    ASSERT_NE(standby, nullptr);
    run.deployment.network().Cut(worker->node(), standby->node(), true);
    run.watch.RunFor(Milliseconds(500));
    run.deployment.store().SetWriteTime(Milliseconds(2000));
    const Tick before = worker->region()->tick();
    run.watch.RunFor(Milliseconds(3000));
    EXPECT_GE(worker->region()->tick() - before, 170) << "3 s at 60 Hz";
    EXPECT_EQ(run.deployment.totals().takeovers, 0U);
    run.deployment.store().SetWriteTime(0);
    run.deployment.network().ClearCuts();
    run.ExpectTruth();
  }
}

TEST_F(LeaderTest, ALeaderWhoseLeaseIsRevokedEarlyWritesNothingMore) {
  LedWorld run;
  SimulatedControl& first = run.leader();
  run.deployment.store().RevokeEarly();
  ASSERT_TRUE(first.alive()) << "it does not know yet";
  EXPECT_FALSE(run.Acknowledges(first, "lost"));
  ASSERT_TRUE(run.AwaitNext(first)) << run.deployment.Standing();
  EXPECT_FALSE(run.Knows("lost"));
  run.ExpectTruth();
}

TEST_F(LeaderTest, AWriteWhoseAnswerIsLostIsAcknowledgedOnceItIsKnownOrNeverAndCostsTheLead) {
  LedWorld run;
  SimulatedControl& first = run.leader();
  run.deployment.store().LoseAnswer(true, Milliseconds(1000));
  EXPECT_TRUE(run.Acknowledges(first, "found-out"));
  run.watch.RunFor(Milliseconds(2000));
  EXPECT_TRUE(first.leads());
  run.deployment.store().LoseAnswer(true, Milliseconds(60'000));
  EXPECT_FALSE(run.Acknowledges(first, "never-known"));
  ASSERT_TRUE(run.AwaitNext(first)) << run.deployment.Standing();
  EXPECT_TRUE(run.Knows("found-out"));
  EXPECT_TRUE(run.Knows("never-known")) << "nobody was told, and it may be there";
  run.ExpectTruth();
}

// A machine is cut off while nobody leads, so whoever is elected never hears of it.
TEST_F(LeaderTest, AReignThatBeginsWithoutAHostSaysSoWithinTwoSeconds) {
  LedWorld run;
  SimulatedControl& first = run.leader();
  first.Kill();
  run.deployment.Cut(run.deployment.Find(RegionId(2))->place(), true);
  ASSERT_TRUE(run.watch.RunUntil(kPatience, [&] { return run.leader().answers(); }));
  run.watch.RunFor(Milliseconds(6000));
  EXPECT_THAT(run.watch.words().problems(), IsEmpty());
  run.deployment.network().ClearCuts();
  run.watch.RunFor(Milliseconds(6000));
  EXPECT_THAT(run.watch.words().problems(), IsEmpty());
}

// All of them, one forward and the others back, while one leads and while the next one carries on a death.
TEST_F(LeaderTest, WallClocksThatAreMovedByHoursEndNoReignAndNoLife) {
  for (const int by : {30, -30}) {
    SCOPED_TRACE(by);
    LedWorld run;
    SimulatedControl& first = run.leader();
    const auto move = [&](int hours) {
      for (const auto& control : run.deployment.controls()) {
        control->MoveClock(std::chrono::hours(control.get() == &first ? hours : -hours));
      }
    };
    ASSERT_TRUE(run.Acknowledges(first, "kept"));
    move(by);
    run.watch.RunFor(Milliseconds(6000));
    EXPECT_TRUE(first.leads());
    EXPECT_THAT(run.watch.leader_gaps(), IsEmpty());
    EXPECT_EQ(run.deployment.totals().takeovers, 0U) << run.deployment.Standing();
    first.Kill();
    ASSERT_TRUE(run.AwaitNext(first)) << run.deployment.Standing();
    run.deployment.Kill(RegionId(2));
    run.watch.RunFor(Milliseconds(100));
    move(-2 * by);
    run.watch.RunFor(Milliseconds(3000));
    EXPECT_EQ(run.deployment.totals().takeovers, 1U) << run.deployment.Standing();
    EXPECT_TRUE(run.Knows("kept"));
    run.ExpectTruth();
  }
}

// Agents that have dialled for long without an answer wait up to 2 s until they dial again.
TEST_F(LeaderTest, AnElectionUnderAWorldThatStepsDegradesItForAMomentAtMost) {
  constexpr std::uint64_t kSeeds = 8;
  std::uint64_t unbroken = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    LedWorld run(seed);
    run.leader().Kill();
    Micros degraded = 0;
    const Micros end = run.deployment.timeline().now() + Milliseconds(9000);
    while (run.deployment.timeline().now() < end) {
      run.watch.RunFor(WorldWatch::kLook);
      const SimulatedControl& leader = run.leader();
      degraded += leader.answers() && run.deployment.SaidBy(leader) != Said::kRunning ? WorldWatch::kLook : 0;
    }
    unbroken += degraded == 0 ? 1 : 0;
    EXPECT_LE(degraded, Milliseconds(700));
    EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  }
  EXPECT_GE(unbroken, kSeeds / 2);
}

TEST_F(LeaderTest, AnOldBackupUnderSeveralControlPlanesEndsNothingAndSetsNothingBack) {
  LedWorld run;
  const std::string backup = run.deployment.store().Backup();
  ASSERT_TRUE(run.deployment.Scale(4));
  ASSERT_TRUE(run.deployment.AwaitCalm()) << run.deployment.Standing();
  const Tick before = run.deployment.tick();
  run.deployment.BeginFrom(backup);
  run.watch.RunFor(Milliseconds(6000));
  EXPECT_EQ(run.deployment.instance().map().regions_size(), 4);
  EXPECT_GE(run.deployment.tick() - before, 350) << "6 s at 60 Hz";
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  run.ExpectTruth();
}

// ./dev sim --world deployment runs as many as there is time for.
TEST_F(LeaderTest, DrawnFaultsOfLeadersAndStoresMakeNobodyLieAndLoseNothing) {
  constexpr std::uint64_t kSeeds = 8;
  std::uint64_t acknowledged = 0, elections = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const LeaderScenario scenario = DrawLeaders(seed);
    const LeaderOutcome outcome = simulation::Run(scenario);
    EXPECT_THAT(outcome.problems, IsEmpty()) << seed << ": " << Describe(scenario);
    EXPECT_EQ(outcome.two_owners + outcome.lies + outcome.lost_changes, 0U) << seed;
    acknowledged += outcome.acknowledged;
    elections += outcome.elections;
  }
  EXPECT_GT(acknowledged, 20 * kSeeds);
  EXPECT_GT(elections, 0U);
}

TEST_F(LeaderTest, EachKindOfFaultIsDrawn) {
  std::set<LeaderFaultKind> kinds;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    for (const LeaderFault& fault : DrawLeaders(seed).faults) kinds.insert(fault.kind);
  }
  EXPECT_EQ(kinds.size(), kLeaderFaultKinds);
}

// Each of these worlds was given up for a standby that was only silent: its agent was dead, or could not be heard.
TEST_F(LeaderTest, AWorldWhoseStandbysAreOnlySilentIsNotGivenUp) {
  for (const std::uint64_t seed : {5233, 6199, 6305, 7027, 10061}) {
    const LeaderScenario scenario = DrawLeaders(seed);
    const LeaderOutcome outcome = simulation::Run(scenario);
    EXPECT_THAT(outcome.problems, IsEmpty()) << seed << ": " << Describe(scenario);
    EXPECT_EQ(outcome.ended, 0U) << seed;
  }
}

TEST_F(LeaderTest, ASeedGivesTheSameRunAgain) {
  const LeaderOutcome one = simulation::Run(DrawLeaders(3)), other = simulation::Run(DrawLeaders(3));
  EXPECT_EQ(one.hash, other.hash);
  EXPECT_EQ(one.steps, other.steps);
  EXPECT_EQ(one.gaps, other.gaps);
}

}  // namespace
}  // namespace tessera::simulation
