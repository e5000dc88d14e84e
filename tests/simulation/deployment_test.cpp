// A whole deployment under faults: the control plane, agents, hosts and workers as they decide in the product.
#include "tests/simulation/deployment.h"

#include <gmock/gmock.h>

#include "tests/simulation/deployed_world.h"

namespace tessera::simulation {
namespace {

class DeploymentTest : public QuietTest {};

struct Deployed : DeployedWorld {
  explicit Deployed(const DeploymentOptions& options = {}) : DeployedWorld(options) {}
  Tick TickOf(std::uint32_t region) { return deployment.Find(RegionId(region))->region()->tick(); }
  bool PausedOn(std::uint32_t host) {
    const std::vector<SimulatedWorker*> workers = deployment.host(host).workers();
    return std::ranges::all_of(workers, [](const SimulatedWorker* worker) { return worker->paused(); });
  }
};

TEST_F(DeploymentTest, AnInstanceStartsAndEveryRegionIsProtected) {
  Deployed run;
  run.ExpectWhole();
  EXPECT_GT(run.deployment.totals().steps, 100U);
}

TEST_F(DeploymentTest, AWorkerThatDiesIsPromotedAndReplaced) {
  Deployed run;
  run.deployment.Kill(RegionId(2));
  run.deployment.RunFor(Milliseconds(200));  // its end was seen: nobody waits for a lease
  EXPECT_EQ(run.deployment.totals().takeovers, 1U) << run.deployment.Standing();
  run.ExpectWhole();
}

// --- Agents.

TEST_F(DeploymentTest, WorkersOutliveTheirAgentAndAreAdoptedByTheNext) {
  Deployed run;
  const Tick before = run.TickOf(1);
  run.deployment.host(1).KillAgent();
  run.deployment.RunFor(Milliseconds(3000));
  EXPECT_GE(run.TickOf(1) - before, 175);  // 3 s at 60 Hz
  run.deployment.host(1).StartAgent();
  run.deployment.RunFor(Milliseconds(1000));
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  run.ExpectWhole();  // nothing was started twice
}

TEST_F(DeploymentTest, AWorkerThatDiesWhileNoAgentRunsIsFoundMissing) {
  for (const Micros back_after : {Milliseconds(200), Milliseconds(4000)}) {
    Deployed run;
    const std::uint32_t place = run.deployment.Find(RegionId(2))->place();
    run.deployment.host(place).KillAgent();
    run.deployment.Kill(RegionId(2));
    run.deployment.RunFor(back_after);
    run.deployment.host(place).StartAgent();
    run.deployment.RunFor(Milliseconds(1000));
    EXPECT_EQ(run.deployment.totals().takeovers, 1U) << back_after;
    run.ExpectWhole();
  }
}

// All stand still and no copy grows; that its workers still ask for leases is what shows that they live.
TEST_F(DeploymentTest, AnAgentThatDiesDuringAFailoverIsNoDeathOfItsWorkers) {
  Deployed run;
  const std::uint32_t place = run.deployment.Find(RegionId(2))->place();
  run.deployment.Kill(RegionId(2));
  run.deployment.host(3 - place).KillAgent();
  run.deployment.RunFor(Milliseconds(3000));
  run.deployment.host(3 - place).StartAgent();
  run.deployment.RunFor(Milliseconds(1000));
  EXPECT_EQ(run.deployment.totals().takeovers, 1U) << run.deployment.Standing();
  run.ExpectWhole();
}

// --- The control plane.

TEST_F(DeploymentTest, WithoutAControlPlaneTheWorldRunsOn) {
  Deployed run;
  const Tick before = run.TickOf(1);
  run.deployment.control().Kill();
  run.deployment.RunFor(Milliseconds(10'000));
  EXPECT_GE(run.TickOf(1) - before, 595);
  run.deployment.control().Start();
  run.deployment.RunFor(Milliseconds(3000));
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  run.ExpectWhole();
}

TEST_F(DeploymentTest, ADeathWhileThereIsNoControlPlaneIsDealtWithByTheNext) {
  Deployed run;
  run.deployment.control().Kill();
  run.deployment.Kill(RegionId(3));
  run.deployment.RunFor(Milliseconds(2000));
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  run.deployment.control().Start();
  run.deployment.RunFor(Milliseconds(1000));
  EXPECT_EQ(run.deployment.totals().takeovers, 1U) << run.deployment.Standing();
  run.ExpectWhole();
}

// At each thing that is stored for a failover and for the new worker thereafter: stored, and nobody told; or else it
// dies before that, when the living may have been told already who carries on what.
void DieAtEachWrite(bool written) {
  int died = 0;
  for (int write = 1; write <= 10; ++write) {
    Deployed run;
    if (written) {
      run.deployment.control().DieAfterStores(write);
    } else {
      run.deployment.control().DieBeforeStore(write);
    }
    run.deployment.Kill(RegionId(2));
    run.deployment.RunUntil(Milliseconds(6000), [&] { return !run.deployment.control().alive(); });
    if (!run.deployment.control().alive()) {
      ++died;
      run.deployment.RunFor(Milliseconds(300));
      run.deployment.control().Start();
    }
    run.ExpectWhole();
    EXPECT_EQ(run.deployment.totals().takeovers, 1U) << write;
  }
  EXPECT_GE(died, 7);
}

TEST_F(DeploymentTest, KilledBetweenStoringAndSendingTheControlPlaneGoesOnWhereItWas) { DieAtEachWrite(true); }

TEST_F(DeploymentTest, KilledBeforeAWriteTheControlPlaneGoesOnWhereItWas) { DieAtEachWrite(false); }

// Two living ones may go by one resolution, which nobody has stored, when their heir dies and another begins anew.
TEST_F(DeploymentTest, WhoWasToldAResolutionThatIsNotStoredMayDieToo) {
  int told = 0;
  for (Micros after = 0; after < Milliseconds(200); after += Milliseconds(5)) {
    Deployed run({.seed = after + 1, .regions = 4});
    const RegionId heir = run.deployment.Find(RegionId(2))->order().standby;
    run.deployment.control().DieBeforeStore(2);
    run.deployment.Kill(RegionId(2));
    if (!run.deployment.RunUntil(Milliseconds(6000), [&] { return !run.deployment.control().alive(); })) continue;
    ++told;
    run.deployment.RunFor(after);
    run.deployment.control().Start();
    run.deployment.RunFor(Milliseconds(300));
    run.deployment.Kill(heir);
    run.ExpectWhole();
    EXPECT_EQ(run.deployment.totals().takeovers, 2U) << after;
    if (HasFailure()) FAIL() << after << run.deployment.Standing();
  }
  EXPECT_GE(told, 30);
}

// Told, and it hears of nothing that comes of it.
TEST_F(DeploymentTest, KilledBetweenSendingAndHearingTheControlPlaneGoesOnWhereItWas) {
  for (Micros after = 500; after < 30'000; after += 1500) {
    Deployed run;
    run.deployment.Kill(RegionId(2));
    run.deployment.RunFor(after);
    run.deployment.control().Kill();
    run.deployment.RunFor(Milliseconds(100));
    run.deployment.control().Start();
    run.ExpectWhole();
    EXPECT_EQ(run.deployment.totals().takeovers, 1U) << after;
  }
}

TEST_F(DeploymentTest, AControlPlaneThatStoodStillTakesNobodyForDead) {
  Deployed run;
  run.deployment.network().SetStalled(kControlNode, true);
  run.deployment.RunFor(Milliseconds(4000));
  run.deployment.network().SetStalled(kControlNode, false);
  run.deployment.RunFor(Milliseconds(2000));
  EXPECT_EQ(run.deployment.totals().takeovers, 0U) << run.deployment.Standing();
  run.ExpectWhole();
}

// It knows of the workers of a dead agent through their standbys, and of those nothing while it stood still.
TEST_F(DeploymentTest, AControlPlaneThatStoodStillTakesNobodyForDeadWhoseAgentIs) {
  for (const Micros stood : {Milliseconds(600), Milliseconds(2000), Milliseconds(4000)}) {
    Deployed run;
    run.deployment.host(1).KillAgent();
    run.deployment.RunFor(Milliseconds(2000));
    run.deployment.network().SetStalled(kControlNode, true);
    run.deployment.RunFor(stood);
    run.deployment.network().SetStalled(kControlNode, false);
    run.deployment.RunFor(Milliseconds(2000));
    run.deployment.host(1).StartAgent();
    EXPECT_EQ(run.deployment.totals().takeovers, 0U) << stood << run.deployment.Standing();
    run.ExpectWhole();
  }
}

// Before a failover, and in its middle.
TEST_F(DeploymentTest, AControlPlaneWhoseClockIsMovedTakesNobodyForDeadAndCountsFailoversTruly) {
  for (const int days : {400, -400}) {
    SCOPED_TRACE(days);
    Deployed run;
    run.deployment.control().MoveClock(std::chrono::hours(24 * days));
    run.deployment.RunFor(Milliseconds(3000));
    EXPECT_EQ(run.deployment.totals().takeovers, 0U) << run.deployment.Standing();
    run.deployment.Kill(RegionId(2));
    ASSERT_TRUE(run.deployment.RunUntil(Milliseconds(200), [&] {
      return run.deployment.instance().map().version() == 2;
    })) << run.deployment.Standing();
    run.deployment.control().MoveClock(std::chrono::hours(-24 * 2 * days));
    run.deployment.RunFor(Milliseconds(1000));
    EXPECT_EQ(run.deployment.totals().takeovers, 1U) << run.deployment.Standing();
    bool told = false;
    const v1::Instance instance = run.deployment.instance();
    for (const v1::InstanceEvent& event : instance.events()) {
      if (event.text().find("failover of region 2 to ") == std::string::npos) continue;
      told = true;
      const std::string took = event.text().substr(event.text().rfind(", ") + 2);  // "17 ms"
      EXPECT_GT(std::stol(took), 0) << event.text();
      EXPECT_LT(std::stol(took), 1000) << event.text();
    }
    EXPECT_TRUE(told);
    run.ExpectWhole();
  }
}

// --- Machines.

// It pauses before its standbys start (checked at each takeover), and ends when it hears that it is fenced.
TEST_F(DeploymentTest, AMachineThatIsCutOffPausesIsPromotedAndEndsItsWorkers) {
  Deployed run;
  run.deployment.Cut(2, true);
  ASSERT_TRUE(run.deployment.RunUntil(Milliseconds(1500), [&] { return run.PausedOn(2); }))
      << run.deployment.Standing();
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  run.deployment.RunFor(Milliseconds(2500));
  EXPECT_EQ(run.deployment.totals().takeovers, 2U) << run.deployment.Standing();
  EXPECT_TRUE(run.PausedOn(2));
  run.deployment.Cut(2, false);
  run.deployment.RunFor(Milliseconds(2000));
  EXPECT_EQ(run.deployment.totals().fenced, 2U);
  run.ExpectWhole();
}

// Silent as its host was already, only what standbys tell of its regions counts; a lease runs for 1 s after the last
// word.
TEST_F(DeploymentTest, AMachineWithoutAnAgentThatIsCutOffHasPausedBeforeItsStandbysStart) {
  for (int i = 0; i < 5; ++i) {
    Deployed run;
    run.deployment.host(2).KillAgent();
    run.deployment.RunFor(Milliseconds(3000) + static_cast<Micros>(i) * Milliseconds(110));
    EXPECT_EQ(run.deployment.totals().takeovers, 0U);  // their standbys hear them
    const Micros cut_at = run.deployment.timeline().now();
    run.deployment.Cut(2, true);
    run.deployment.RunFor(Milliseconds(3000));
    EXPECT_EQ(run.deployment.totals().takeovers, 2U) << run.deployment.Standing();
    EXPECT_GE(run.deployment.totals().first_takeover_at - cut_at, Milliseconds(950)) << i;
    run.ExpectWhole();
  }
}

TEST_F(DeploymentTest, AShortCutIsOutlivedByBothSides) {
  Deployed run;
  run.deployment.Cut(2, true);
  run.deployment.RunFor(Milliseconds(600));
  run.deployment.Cut(2, false);
  run.deployment.RunFor(Milliseconds(2000));
  EXPECT_EQ(run.deployment.totals().takeovers, 0U) << run.deployment.Standing();
  run.ExpectWhole();
}

// Nobody took over, for there was nobody to say so: it goes on.
TEST_F(DeploymentTest, AMachineThatWasCutOffGoesOnIfNobodyTookOver) {
  Deployed run;
  run.deployment.control().Kill();
  run.deployment.Cut(2, true);
  run.deployment.RunFor(Milliseconds(3000));
  EXPECT_TRUE(run.PausedOn(2)) << run.deployment.Standing();
  run.deployment.Cut(2, false);
  run.deployment.RunFor(Milliseconds(1500));
  EXPECT_FALSE(run.PausedOn(2)) << run.deployment.Standing();
  run.deployment.control().Start();
  run.deployment.RunFor(Milliseconds(1500));
  EXPECT_EQ(run.deployment.totals().takeovers, 0U) << run.deployment.Standing();
  run.ExpectWhole();
}

TEST_F(DeploymentTest, AMachineThatCrashesIsPromotedAndComesBackEmpty) {
  for (const Micros down : {Milliseconds(300), Milliseconds(5000)}) {
    Deployed run;
    run.deployment.host(1).Crash();
    run.deployment.RunFor(down);
    run.deployment.host(1).StartAgent();
    run.deployment.RunFor(Milliseconds(2000));
    EXPECT_EQ(run.deployment.totals().takeovers, 2U) << run.deployment.Standing();
    run.ExpectWhole();
  }
}

// All that the crashed machine ran is carried on by workers of the other one, which live and whom nobody can ask.
TEST_F(DeploymentTest, AWorldWhoseStandbysNoAgentSpeaksForWaitsForOneAndLosesNothing) {
  for (const Micros away : {Milliseconds(3000), Milliseconds(20'000)}) {
    Deployed run;
    run.deployment.host(2).KillAgent();
    run.deployment.host(1).Crash();
    run.deployment.RunFor(Milliseconds(1000));
    run.deployment.host(1).StartAgent();
    run.deployment.RunFor(away);
    EXPECT_EQ(run.deployment.instance().state(), v1::INSTANCE_STATE_DEGRADED) << run.deployment.Standing();
    EXPECT_THAT(run.deployment.instance().reason(), testing::HasSubstr("waits for host host2, silent since "));
    run.deployment.host(2).StartAgent();
    run.deployment.RunFor(Milliseconds(2000));
    EXPECT_EQ(run.deployment.totals().takeovers, 2U) << run.deployment.Standing();
    run.ExpectWhole();
  }
}

// The standby's copy is old then. Bodies that come in meanwhile are acknowledged to nobody, so whoever granted them has
// them still.
TEST_F(DeploymentTest, ARegionThatDiesLongAfterItsStandbyHeardOfItLosesNoBody) {
  for (std::uint32_t region = 1; region <= 4; ++region) {
    for (const Micros deaf : {Milliseconds(700), Milliseconds(2500), Milliseconds(5000)}) {
      Deployed run({.seed = region});
      const SimulatedWorker& worker = *run.deployment.Find(RegionId(region));
      const Node node = worker.node(), standby = run.deployment.Find(worker.order().standby)->node();
      run.deployment.network().Cut(node, standby, true);
      run.deployment.RunFor(deaf);
      EXPECT_EQ(worker.Protected(), deaf < Milliseconds(2000));
      EXPECT_FALSE(worker.paused());  // the control plane hears it
      run.deployment.Kill(RegionId(region));
      run.deployment.RunFor(Milliseconds(1000));
      run.deployment.network().Cut(node, standby, false);
      run.ExpectWhole();
      if (HasFailure()) FAIL() << region << " " << deaf << run.deployment.Standing();
    }
  }
}

// --- A link that two regions alone have lost.

struct LostStandby : Deployed {
  explicit LostStandby(DeploymentOptions options) : Deployed(options) {
    region = deployment.Find(RegionId(1));
    standby = deployment.Find(region->order().standby);
    deployment.network().Cut(region->node(), standby->node(), true);
  }
  SimulatedWorker *region, *standby;
};

// Bodies on their way to it could not be acknowledged: the change would have no end.
TEST_F(DeploymentTest, ARegionThatItsStandbyAloneDoesNotHearIsGivenAnotherAndAChangeEnds) {
  for (const std::uint32_t regions : {3U, 6U}) {
    LostStandby run({.regions = 4});
    run.deployment.RunFor(Milliseconds(1500));
    EXPECT_FALSE(run.region->Protected());
    ASSERT_TRUE(run.deployment.Scale(regions));
    // Where both are neighbours still, the world is degraded for the link that they lack, and for nothing else.
    const auto still = [&run] { return run.deployment.Still(); };
    EXPECT_TRUE(run.deployment.RunUntil(Milliseconds(25'000), still)) << run.deployment.Standing();
    EXPECT_EQ(run.deployment.totals().takeovers, 0U);
    if (SimulatedWorker* now = run.deployment.Find(RegionId(1))) {
      EXPECT_NE(now->order().standby, run.standby->identity().region);
      EXPECT_TRUE(now->Protected());
    }
    run.ExpectWhole();
  }
}

TEST_F(DeploymentTest, WithoutAnotherStandbyAChangeWaitsForTheLinkAndSaysSo) {
  LostStandby run({.regions = 2});
  run.deployment.RunFor(Milliseconds(1500));
  ASSERT_TRUE(run.deployment.Scale(1));
  run.deployment.RunFor(Milliseconds(12'000));
  EXPECT_FALSE(run.deployment.Calm());
  const v1::Instance instance = run.deployment.instance();
  EXPECT_EQ(instance.unprotected_regions_size(), 2);
  ASSERT_EQ(instance.changes_size(), 1);
  EXPECT_THAT(instance.changes(0).text(), testing::HasSubstr("to hand over"));
  EXPECT_THAT(instance.changes(0).text(), testing::HasSubstr("region 1 is unprotected and acknowledges nothing"));
  run.deployment.network().Cut(run.region->node(), run.standby->node(), false);
  EXPECT_TRUE(run.deployment.AwaitCalm()) << run.deployment.Standing();
  run.ExpectWhole();
}

// --- Lost together.

struct Checkpointed : Deployed {
  Checkpointed() : Deployed({.checkpoint_interval = std::chrono::milliseconds(5000)}) {
    EXPECT_TRUE(deployment.RunUntil(Milliseconds(9000), [&] { return deployment.instance().checkpoints_size() > 0; }));
  }
};

TEST_F(DeploymentTest, ARegionAndItsStandbyLostTogetherComeBackFromTheCheckpointAsALossOfTime) {
  Checkpointed run;
  const std::uint64_t saved = run.deployment.instance().checkpoints(0).tick();
  run.deployment.RunFor(Milliseconds(1000));
  const Tick last = run.TickOf(2);
  const RegionId standby = run.deployment.Find(RegionId(2))->order().standby;
  run.deployment.Kill(RegionId(2));
  run.deployment.Kill(standby);
  run.deployment.Restored();
  run.deployment.RunFor(Milliseconds(3000));
  EXPECT_NEAR(static_cast<double>(run.deployment.instance().lost_ticks()), static_cast<double>(last.value() - saved),
              60);
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  run.ExpectWhole();
}

TEST_F(DeploymentTest, ARegionAndItsStandbyLostTogetherWithoutACheckpointAreNeverASuccess) {
  Deployed run;
  const RegionId standby = run.deployment.Find(RegionId(2))->order().standby;
  run.deployment.Kill(RegionId(2));
  run.deployment.Kill(standby);
  run.deployment.ExcuseAll();
  run.deployment.RunFor(Milliseconds(1000));
  EXPECT_EQ(run.deployment.instance().state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(run.deployment.instance().reason(), testing::HasSubstr("lost together with its standby"));
}

TEST_F(DeploymentTest, AStandbyThatDiesDuringTheTakeoverCostsTheTimeSinceTheCheckpoint) {
  Checkpointed run;
  run.deployment.RunFor(Milliseconds(500));
  const RegionId standby = run.deployment.Find(RegionId(2))->order().standby;
  run.deployment.Kill(RegionId(2));
  run.deployment.RunFor(1200);  // the failover has been stored and ordered
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  run.deployment.Kill(standby);
  run.deployment.Restored();
  run.deployment.RunFor(Milliseconds(3000));
  EXPECT_GT(run.deployment.instance().lost_ticks(), 0U);
  run.ExpectWhole();
}

}  // namespace
}  // namespace tessera::simulation
