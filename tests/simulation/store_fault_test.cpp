// A control plane whose store is slow or full while workers die: the world may stand for it, and may not be called
// RUNNING while it does.
#include <gmock/gmock.h>

#include <vector>

#include "tests/simulation/chance.h"
#include "tests/simulation/deployed_world.h"
#include "tests/simulation/world_watch.h"

namespace tessera::simulation {
namespace {

using ::testing::HasSubstr;

constexpr Micros kFalseAtMost = WordBounds().at_most;

class StoreFaultTest : public QuietTest {};

struct StoreWorld : DeployedWorld {
  explicit StoreWorld(std::uint64_t seed = 1)
      : DeployedWorld({.seed = seed, .regions = 4}, MomentOf(seed)), watch(deployment), words(watch.words()) {}
  std::uint32_t StandbyOf(std::uint32_t region) { return deployment.Find(RegionId(region))->order().standby.value(); }
  // Two regions that may both die: neither is the other's standby.
  std::vector<std::uint32_t> Apart() {
    for (std::uint32_t one = 1; one <= 4; ++one) {
      for (std::uint32_t other = one + 1; other <= 4; ++other) {
        if (StandbyOf(one) != other && StandbyOf(other) != one) return {one, other};
      }
    }
    return {};
  }

  WorldWatch watch;
  FalseWords& words;
};

// A check that finds nothing false must be able to.
TEST_F(StoreFaultTest, TheCheckerSeesAWorldThatIsCalledRunningAndStands) {
  StoreWorld run;
  run.watch.RunFor(Milliseconds(500));
  EXPECT_EQ(run.words.false_running(), 0U);
  run.deployment.network().SetStalled(run.deployment.Find(RegionId(2))->node(), true);
  run.watch.RunFor(Milliseconds(1500));  // it is called still after two seconds
  EXPECT_GE(run.words.false_running(), Milliseconds(1000));
  run.deployment.network().SetStalled(run.deployment.Find(RegionId(2))->node(), false);
  run.ExpectWhole();
}

TEST_F(StoreFaultTest, WritesOfTwoSecondsDelayAFailoverAndTakeNobodyForDead) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    StoreWorld run(seed);
    run.deployment.control().SetWriteTime(Milliseconds(2000));
    run.watch.RunFor(Milliseconds(10'000));
    EXPECT_EQ(run.words.stood(), 0U);
    EXPECT_EQ(run.deployment.totals().takeovers, 0U);
    run.deployment.Kill(RegionId(2));
    run.watch.RunFor(Milliseconds(30'000));
    EXPECT_EQ(run.deployment.totals().takeovers, 1U) << run.deployment.Standing();
    // The failover's map alone is written before anybody hears of it.
    EXPECT_LE(run.words.stood(), Milliseconds(2000 + 500));
    // It writes with its lock held: the map; and after it went on, the resolution, the end and what comes then.
    EXPECT_LE(run.words.silent(), Milliseconds(4 * 2000 + 100));
    EXPECT_LE(run.words.false_running(), kFalseAtMost);
    EXPECT_LE(run.words.false_degraded(), kFalseAtMost);
    run.deployment.control().SetWriteTime(0);
    run.ExpectWhole();
  }
}

TEST_F(StoreFaultTest, WhileItsDiskIsFullAWorldThatStepsIsRunningAndOneThatDoesNotIsDegraded) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    StoreWorld run(seed);
    const std::vector<std::uint32_t> die = run.Apart();
    ASSERT_EQ(die.size(), 2U);
    run.deployment.control().SetStoreFull(true);
    run.watch.RunFor(Milliseconds(10'000));
    EXPECT_EQ(run.deployment.instance().state(), v1::INSTANCE_STATE_RUNNING) << run.deployment.instance().reason();
    Chance chance(seed);
    for (const std::uint32_t region : die) {
      run.deployment.Kill(RegionId(region));
      run.watch.RunFor(Milliseconds(5000) + chance.Below(Milliseconds(20'000)));
      EXPECT_EQ(run.deployment.instance().state(), v1::INSTANCE_STATE_DEGRADED);
      EXPECT_THAT(run.deployment.instance().reason(), HasSubstr("its next step is not stored: "));
    }
    EXPECT_EQ(run.deployment.totals().takeovers, 0U);
    run.deployment.control().SetStoreFull(false);
    run.watch.RunFor(Milliseconds(20'000));
    EXPECT_EQ(run.deployment.totals().takeovers, 2U) << run.deployment.Standing();
    EXPECT_LE(run.words.false_running(), kFalseAtMost);
    EXPECT_LE(run.words.false_degraded(), kFalseAtMost);
    run.ExpectWhole();
  }
}

// Its disk has room now and then, for too short a time for a whole failover at some of its writes.
TEST_F(StoreFaultTest, ADiskThatIsFullAgainAndAgainLosesNothingAndNothingIsSaidFalsely) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    StoreWorld run(seed);
    Chance chance(seed);
    for (int i = 0; i < 20; ++i) {
      if (i == 11) {  // nothing is under way any more, so that another one may die
        run.deployment.control().SetStoreFull(false);
        ASSERT_TRUE(run.deployment.AwaitCalm()) << run.deployment.Standing();
      }
      if (i == 3 || i == 11) {
        const std::vector<SimulatedWorker*> workers = run.deployment.Workers();
        run.deployment.Kill(*workers[chance.Below(workers.size())]);
      }
      run.deployment.control().SetStoreFull(chance.Happens(0.7));
      run.deployment.control().SetWriteTime(chance.Below(Milliseconds(40)));
      run.watch.RunFor(chance.Below(Milliseconds(1500)));
    }
    run.deployment.control().SetStoreFull(false);
    run.deployment.control().SetWriteTime(0);
    EXPECT_LE(run.words.false_running(), kFalseAtMost);
    run.ExpectWhole();
    if (HasFailure()) FAIL() << run.deployment.Standing();
  }
}

}  // namespace
}  // namespace tessera::simulation
