// Regions that begin while the world runs, and what may die about them, in a whole deployment.
#include <gmock/gmock.h>

#include <algorithm>
#include <vector>

#include "tests/simulation/deployed_world.h"
#include "tests/simulation/deployment.h"

namespace tessera::simulation {
namespace {

class NewcomerTest : public QuietTest {};

struct Growing : DeployedWorld {
  explicit Growing(DeploymentOptions options) : DeployedWorld(options) {
    EXPECT_TRUE(deployment.Scale(5));
    EXPECT_TRUE(deployment.RunUntil(Milliseconds(2000), [&] { return deployment.Newcomer() != nullptr; }));
    node = deployment.Newcomer()->node();
  }
  // The life that came first, whether its map is in force or not.
  const SimulatedWorker& newcomer() {
    const std::vector<SimulatedWorker*> workers = deployment.Workers();
    return **std::ranges::find_if(workers, [this](const SimulatedWorker* worker) { return worker->node() == node; });
  }
  bool HasStepped() { return newcomer().region() != nullptr && newcomer().core().run()->ticks().stepped(); }
  void KillNewcomer() {
    deployment.Kill(newcomer());
    deployment.RunFor(Milliseconds(2000));
    ExpectWhole();
  }

  Node node = 0;
};

TEST_F(NewcomerTest, MayDieBeforeItsMapIsInForce) {
  for (Micros after = 0; after < Milliseconds(250); after += Milliseconds(10)) {
    Growing run({.seed = after + 1});
    run.deployment.RunFor(after);
    ASSERT_FALSE(run.HasStepped());
    run.KillNewcomer();
    if (HasFailure()) FAIL() << after << run.deployment.Standing();
  }
}

// At each moment of its first ticks, with and without what it owns and with and without a copy of that.
TEST_F(NewcomerTest, MayDieInItsFirstTicks) {
  int unprotected = 0, owners = 0, carried_on = 0;
  for (Micros after = 0; after < Milliseconds(60); after += Milliseconds(1)) {
    Growing run({.seed = after + 1});
    run.deployment.network().conditions().delay = Milliseconds(3);  // so that its standby lags some of its ticks
    ASSERT_TRUE(run.deployment.RunUntil(Milliseconds(5000), [&] { return run.HasStepped(); }));
    run.deployment.RunFor(after);
    unprotected += run.newcomer().Protected() ? 0 : 1;
    owners += run.newcomer().region()->owned().empty() ? 0 : 1;
    run.KillNewcomer();
    carried_on += run.deployment.totals().takeovers > 0 ? 1 : 0;
    if (HasFailure()) FAIL() << after << run.deployment.Standing();
  }
  EXPECT_GT(unprotected, 0);
  EXPECT_GT(owners, 0);
  EXPECT_GT(carried_on, 0);
}

// It has not stepped when its map comes into force, and the others go on without it, and to the next map.
TEST_F(NewcomerTest, OneThatANeighbourDoesNotHearFromTheFirstTickOnComesToTheNextMapAsWell) {
  for (std::uint32_t neighbor = 1; neighbor <= 4; ++neighbor) {
    Growing run({.seed = neighbor});
    ASSERT_TRUE(run.deployment.RunUntil(Milliseconds(2000), [&] { return run.newcomer().running(); }));
    ASSERT_FALSE(run.HasStepped());
    const Node other = run.deployment.Find(RegionId(neighbor))->node();
    run.deployment.network().Cut(run.node, other, true);
    run.deployment.RunFor(Milliseconds(9000));
    run.deployment.network().Cut(run.node, other, false);
    run.ExpectWhole();
    if (HasFailure()) FAIL() << neighbor << run.deployment.Standing();
  }
}

TEST_F(NewcomerTest, AMachineWithOneMayBeCutOffAtAnyTime) {
  for (Micros after = 0; after < Milliseconds(700); after += Milliseconds(50)) {
    Growing run({.seed = after + 1, .hosts = 3});
    const std::uint32_t place = run.newcomer().place();
    run.deployment.RunFor(after);
    run.deployment.Cut(place, true);
    run.deployment.RunFor(Milliseconds(4000));
    run.deployment.Cut(place, false);
    run.deployment.RunFor(Milliseconds(2000));
    run.ExpectWhole();
    if (HasFailure()) FAIL() << after << run.deployment.Standing();
  }
}

}  // namespace
}  // namespace tessera::simulation
