// Worlds that outlive their processes: workers, agents and the control plane are killed while players play.
#include <csignal>

#include "host/process.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

class FailoverTest : public WorldTest {
 protected:
  // Changes a property of the first player's body by the command line; returns when every player sees it.
  testing::AssertionResult SetHealth(const std::string& health) {
    const auto done = Tessera({"instance", "set-property", run_->instance_id(), BodyOfFirst(), "health", health});
    if (done.exit_code != 0) return testing::AssertionFailure() << done.err;
    return PlayUntil("health " + health, [&] { return AllSeeHealth(std::stoll(health)); });
  }
  bool AllSeeHealth(std::int64_t health) {
    return std::ranges::all_of(run_->bots(), [&](local::Bot* bot) {
      return bot->client().PropertyOf(PlayerBodyId(PlayerNumber(1)), "health") == PropertyValue(health);
    });
  }
  static std::string BodyOfFirst() { return std::to_string(PlayerBodyId(PlayerNumber(1)).value()); }
};

TEST_F(FailoverTest, ANeighbourCarriesAKilledWorkersAreaOn) {
  Start(4, 2);
  ASSERT_TRUE(PlayUntilProtected());
  ASSERT_TRUE(PlayOn(1));
  ASSERT_TRUE(SetHealth("80"));
  const v1::WorkerReport victim = ReportOf(1);  // made the first player's body
  ASSERT_EQ(kill(static_cast<pid_t>(victim.identity().pid()), SIGKILL), 0);
  ASSERT_TRUE(PlayUntilFailedOver());
  EXPECT_EQ(run_->Latest().lost_bodies(), 0u);
  ASSERT_TRUE(PlayUntil("a new worker in its place", [&] { return IsSettled() && run_->Latest().regions() == 4; }));
  ASSERT_TRUE(PlayOn(2));
  const auto follow = [&] {
    return std::ranges::all_of(run_->bots(), [&](local::Bot* bot) {
      return bot->client().map().version() == MapVersion(run_->Latest().map().version());
    });
  };
  ASSERT_TRUE(PlayUntil("clients with the new map", follow));
  EXPECT_TRUE(AllSeeHealth(80)) << "as before the death";
  ASSERT_TRUE(SetHealth("-5"));
  ExpectAllIsThere();
}

// They share a border and the corner with the other two, who have the copies of both.
TEST_F(FailoverTest, TwoNeighboursThatAreKilledTogetherAreCarriedOnByTheOtherTwoOfTheirCorner) {
  Start(4, 2);
  ASSERT_TRUE(PlayUntilProtected());
  ASSERT_TRUE(PlayOn(1));
  std::vector<pid_t> victims;
  const v1::Instance before = run_->Latest();
  for (const v1::RegionStatus& status : before.region_status()) {
    if (status.host() == "local-1") victims.push_back(static_cast<pid_t>(status.report().identity().pid()));
  }
  ASSERT_EQ(victims.size(), 2u);
  for (const pid_t victim : victims) ASSERT_EQ(kill(victim, SIGKILL), 0);
  ASSERT_TRUE(PlayUntilFailedOver());
  EXPECT_EQ(run_->Latest().lost_bodies(), 0u);
  ASSERT_TRUE(PlayUntil("new workers in their places", [&] { return IsSettled() && run_->Latest().regions() == 4; }));
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

// In a local cluster workers end with their agent: killing that is what the end of a host is.
TEST_F(FailoverTest, TheOtherHostCarriesADeadHostsRegionsOn) {
  Start(4, 2);
  ASSERT_TRUE(PlayUntilProtected());
  ASSERT_TRUE(PlayOn(1));
  run_->cluster().KillAgent(0);
  ASSERT_TRUE(PlayUntilFailedOver());
  EXPECT_EQ(run_->Latest().lost_bodies(), 0u);
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

TEST_F(FailoverTest, AnAgentKilledAloneLosesNoWorkerAndTheNextOneAdoptsThem) {
  Start({.scene = "", .regions = 4, .bots = kBots, .hosts = 2, .workers_outlive_agents = true});
  ASSERT_TRUE(PlayUntilProtected());
  const std::map<std::uint32_t, std::int64_t> pids = Pids();
  run_->cluster().KillAgent(0);
  run_->cluster().RestartAgent(0);
  ASSERT_TRUE(PlayOn(2));  // reports come from all regions: those of the new agent's workers too
  EXPECT_EQ(Pids(), pids);
  EXPECT_EQ(run_->Latest().failovers(), 0u);
  ExpectAllIsThere();
  for (const auto& [region, pid] : pids) EXPECT_FALSE(host::IsAlive(pid)) << "region " << region;
}

TEST_F(FailoverTest, TheWorldRunsOnWhileTheControlPlaneIsDead) {
  Start(4, 2);
  ASSERT_TRUE(PlayUntilProtected());
  const std::map<std::uint32_t, std::int64_t> pids = Pids();
  run_->cluster().KillControl();
  const std::uint64_t killed_at = run_->bots()[0]->client().tick().value();
  ASSERT_TRUE(PlayUntil("the world without a control plane",
                        [&] { return run_->bots()[0]->client().tick().value() > killed_at + 240; }));
  run_->cluster().RestartControl();
  run_->WatchAnew();
  ASSERT_TRUE(PlayOn(2));
  EXPECT_EQ(run_->Latest().failovers(), 0u);
  EXPECT_EQ(Pids(), pids);
  ExpectAllIsThere();
}

TEST_F(FailoverTest, AWorkerThatDiesWhileTheControlPlaneIsDeadIsReplacedWhenItIsBack) {
  Start(4, 2);
  ASSERT_TRUE(PlayUntilProtected());
  const auto victim = static_cast<pid_t>(ReportOf(3).identity().pid());
  run_->cluster().KillControl();
  ASSERT_EQ(kill(victim, SIGKILL), 0);
  run_->cluster().RestartControl();
  run_->WatchAnew();
  ASSERT_TRUE(PlayUntilFailedOver());
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

}  // namespace
}  // namespace tessera::end_to_end
