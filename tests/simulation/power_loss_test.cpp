// Power that fails for all machines at once, those of the control plane too: the world begins again from its
// checkpoint, and how much time that cost is told from what agents had kept on their disks.
#include <gmock/gmock.h>

#include "absl/strings/str_cat.h"
#include "tests/simulation/deployed_world.h"

namespace tessera::simulation {
namespace {

class PowerLossTest : public QuietTest {};

struct CheckpointedWorld : DeployedWorld {
  explicit CheckpointedWorld(std::uint64_t seed)
      : DeployedWorld(
            {.seed = seed, .hosts = 3, .regions = 4, .checkpoint_interval = std::chrono::milliseconds(12'000)},
            MomentOf(seed)) {
    EXPECT_TRUE(
        deployment.RunUntil(Milliseconds(20'000), [&] { return deployment.instance().checkpoints_size() > 0; }));
  }
};

TEST_F(PowerLossTest, TimeThatIsLostIsCountedAlsoWhereAllMachinesAreOffAtOnce) {
  constexpr std::uint64_t kTicksOfFile = 5 * 60 + 60;  // that agents' files are old at most, and a report's way
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    CheckpointedWorld run(seed);
    const std::uint64_t saved = run.deployment.instance().checkpoints(0).tick();
    // The next checkpoint is not made yet.
    run.deployment.RunFor(Milliseconds(9000));
    ASSERT_EQ(run.deployment.instance().checkpoints_size(), 1);
    const std::uint64_t reached = run.deployment.tick().value();
    run.deployment.Restored();
    run.deployment.KillControls();
    for (std::uint32_t host = 1; host <= 3; ++host) run.deployment.host(host).Crash();
    run.deployment.RunFor(Milliseconds(2000));
    run.deployment.StartControls();
    for (std::uint32_t host = 1; host <= 3; ++host) run.deployment.host(host).StartAgent();
    ASSERT_TRUE(run.deployment.AwaitCalm()) << run.deployment.Standing();
    const v1::Instance instance = run.deployment.instance();
    EXPECT_LE(instance.lost_ticks(), reached - saved) << run.deployment.Standing();
    EXPECT_GT(instance.lost_ticks(), 0U);
    EXPECT_GE(instance.lost_ticks() + kTicksOfFile, reached - saved) << run.deployment.Standing();
    ASSERT_GT(instance.events_size(), 0);
    EXPECT_THAT(instance.events().rbegin()->text(),
                testing::HasSubstr(absl::StrCat("at least ", instance.lost_ticks(), " ticks lost")));
    EXPECT_THAT(run.deployment.control().log(), testing::Contains(testing::HasSubstr("time lost id=")));
    run.ExpectWhole();
  }
}

// Nobody is known to be dead, so nothing is done by itself. Machines that were only cut off go on where they were.
TEST_F(PowerLossTest, AWorldWhoseHostsAllFallSilentAtOnceSaysWhomItWaitsForUntilTheySpeak) {
  for (const bool cut : {true, false}) {
    SCOPED_TRACE(cut ? "cut off" : "crashed");
    CheckpointedWorld run(1);
    Deployment& deployment = run.deployment;
    deployment.RunFor(Milliseconds(9000));  // the next checkpoint is not made yet
    const std::uint64_t map = deployment.instance().map().version();
    if (!cut) deployment.Restored();
    for (std::uint32_t host = 1; host <= 3; ++host) {
      if (cut) {
        deployment.Cut(host, true);
      } else {
        deployment.host(host).Crash();
      }
    }
    deployment.RunFor(Milliseconds(60'000));
    const v1::Instance waiting = deployment.instance();
    EXPECT_EQ(waiting.state(), v1::INSTANCE_STATE_DEGRADED) << deployment.Standing();
    EXPECT_EQ(waiting.map().version(), map) << "nobody was declared dead";
    EXPECT_THAT(waiting.reason(), testing::ContainsRegex("waits for host host[1-3], silent since .*: region"));
    EXPECT_THAT(waiting.reason(), testing::HasSubstr("if a machine is gone for good: tessera host remove "));
    for (std::uint32_t host = 1; host <= 3; ++host) {
      if (cut) {
        deployment.Cut(host, false);
      } else {
        deployment.host(host).StartAgent();
      }
    }
    ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
    EXPECT_EQ(deployment.instance().lost_ticks() > 0, !cut) << deployment.instance().lost_ticks();
    run.ExpectWhole();
  }
}

}  // namespace
}  // namespace tessera::simulation
