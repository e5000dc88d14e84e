// A control plane whose machine is lost, and another one that begins from an old backup under a world that ran on: the
// product's control plane, agents and workers in virtual time. Nothing is ended, set back, owned twice or given twice.
#include <gmock/gmock.h>

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "tests/simulation/chance.h"
#include "tests/simulation/deployed_world.h"

namespace tessera::simulation {
namespace {

class OldBackupTest : public QuietTest {};

struct BackedUpWorld : DeployedWorld {
  explicit BackedUpWorld(std::uint64_t seed)
      : DeployedWorld({.seed = seed, .hosts = 3, .regions = 4}, MomentOf(seed)),
        backup(deployment.control().Backup()) {}

  std::set<Node> Lives() const {
    std::set<Node> lives;
    for (const SimulatedWorker* worker : deployment.Workers()) lives.insert(worker->node());
    return lives;
  }
  // Requires that the world is calm, so that each region's standby has a copy.
  void KillAny(Chance& chance) {
    const std::vector<SimulatedWorker*> workers = deployment.Workers();
    deployment.Kill(*workers[chance.Below(workers.size())]);
  }

  std::string backup;
};

TEST_F(OldBackupTest, AWorldThatWasScaledSinceRunsOnAsItIs) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    BackedUpWorld run(seed);
    ASSERT_TRUE(run.deployment.Scale(6));
    ASSERT_TRUE(run.deployment.AwaitCalm()) << run.deployment.Standing();
    const std::set<Node> lives = run.Lives();
    const Tick before = run.deployment.tick();
    run.deployment.control().BeginFrom(run.backup);
    run.deployment.RunFor(Milliseconds(5000));
    EXPECT_EQ(run.Lives(), lives) << run.deployment.Standing();
    EXPECT_GE(run.deployment.tick() - before, 295) << "all step, at 60 Hz";
    EXPECT_EQ(run.deployment.totals().takeovers, 0U);
    EXPECT_EQ(run.deployment.instance().map().regions_size(), 6);
    run.deployment.Kill(RegionId(2));
    run.deployment.RunFor(Milliseconds(1000));
    EXPECT_EQ(run.deployment.totals().takeovers, 1U) << "it leads the world: " << run.deployment.Standing();
    run.ExpectWhole();
    if (HasFailure()) FAIL() << run.deployment.Standing();
  }
}

// Before the backup is put back, while there is no control plane, and at any moment of the recovery.
TEST_F(OldBackupTest, WhoeverDiesAroundARestoreIsCarriedOnOnceAndNothingIsLost) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    BackedUpWorld run(seed);
    Chance chance(seed);
    run.KillAny(chance);
    ASSERT_TRUE(run.deployment.AwaitCalm()) << run.deployment.Standing();
    EXPECT_EQ(run.deployment.totals().takeovers, 1U);
    const bool before = chance.Happens(0.5);
    if (before) {
      run.deployment.control().Kill();
      run.KillAny(chance);
      run.deployment.RunFor(chance.Below(Milliseconds(3000)));
    }
    run.deployment.control().BeginFrom(run.backup);
    if (!before) {
      run.deployment.RunFor(chance.Below(Milliseconds(400)));
      run.KillAny(chance);
    }
    run.deployment.RunFor(Milliseconds(3000));
    EXPECT_TRUE(run.deployment.AwaitCalm()) << run.deployment.Standing();
    EXPECT_EQ(run.deployment.totals().takeovers, 2U);
    run.ExpectWhole();
    if (HasFailure()) FAIL() << run.deployment.Standing();
  }
}

// Wherever a failover and the plan that replaces the dead have come to: what the hosts hold is carried on, or begun
// anew.
TEST_F(OldBackupTest, AControlPlaneThatIsLostInTheMiddleOfAFailoverOrAReplacementTakesNothingAlong) {
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    BackedUpWorld run(seed);
    Chance chance(seed);
    run.deployment.control().DieAfterStores(1 + static_cast<int>(chance.Below(12)));
    run.KillAny(chance);
    run.deployment.RunUntil(Milliseconds(8000), [&run] { return !run.deployment.control().alive(); });
    run.deployment.RunFor(chance.Below(Milliseconds(1000)));
    run.deployment.control().BeginFrom(run.backup);
    run.deployment.RunFor(Milliseconds(3000));
    EXPECT_EQ(run.deployment.totals().takeovers, 1U);
    // Nobody knows of a replacement that no agent had heard of; where the world has its four regions this is nothing.
    EXPECT_TRUE(run.deployment.Scale(4));
    EXPECT_TRUE(run.deployment.AwaitCalm()) << run.deployment.Standing();
    run.ExpectWhole();
    if (HasFailure()) FAIL() << run.deployment.Standing();
  }
}

}  // namespace
}  // namespace tessera::simulation
