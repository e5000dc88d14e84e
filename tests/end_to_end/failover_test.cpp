// Worlds that outlive their processes: workers, agents and the control plane are killed while players play.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "local_cluster/instance_state.h"
#include "local_cluster/world_run.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {
namespace {

using namespace std::chrono_literals;

constexpr double kPatience_s = 150;  // which only a failing test waits out
constexpr std::uint32_t kBodies = 200, kBots = 2;

class FailoverTest : public testing::Test {
 protected:
  void Start(std::uint32_t regions, std::uint32_t hosts, std::uint32_t capacity = 0) {
    run_ = std::make_unique<local::WorldRun>(local::RunOptions{.scene = support::ScenePath("plaza"),
                                                               .regions = regions,
                                                               .bodies = kBodies,
                                                               .bots = kBots,
                                                               .hosts = hosts,
                                                               .capacity = capacity});
  }
  // Plays on until it holds; false, with the state of the instance, if the world or a player ended or time is up.
  testing::AssertionResult PlayUntil(const std::string& what, const std::function<bool()>& holds) {
    const double begin = run_->running_s();
    while (!holds()) {
      const bool ended = !run_->Frame();
      if (ended || run_->running_s() - begin > kPatience_s) {
        return testing::AssertionFailure() << (ended ? "it ended before " : "never: ") << what << "\n"
                                           << run_->Latest().ShortDebugString();
      }
      std::this_thread::sleep_for(5ms);  // paces the bots' frames
    }
    return testing::AssertionSuccess();
  }
  v1::WorkerReport ReportOf(std::uint32_t region) {
    const v1::Instance instance = run_->Latest();
    for (const v1::RegionStatus& status : instance.region_status()) {
      if (status.region() == region) return status.report();
    }
    return {};
  }
  // And every player sees all there is: what moves, and the scene's ground and walls.
  bool IsProtected() {
    const v1::Instance instance = run_->Latest();
    bodies_in_view_ = run_->bots().empty() ? 0 : run_->bots()[0]->client().World().size();
    return instance.state() == v1::INSTANCE_STATE_RUNNING && instance.unprotected_regions().empty() &&
           bodies_in_view_ >= kBodies + kBots && std::ranges::all_of(instance.region_status(), [](const auto& status) {
             return status.report().acknowledged_tick() > 60;
           });
  }
  // `more` complete censuses from now on.
  testing::AssertionResult PlayOn(std::uint64_t more) {
    const auto counted = [&] { return run_->conservation() ? run_->conservation()->censuses : 0; };
    const std::uint64_t before = counted();
    return PlayUntil("further censuses", [&] { return counted() >= before + more; });
  }
  void ExpectAllIsThere() {
    const auto found = run_->conservation();
    ASSERT_TRUE(found.has_value());
    EXPECT_EQ(found->lost, 0u);
    EXPECT_EQ(found->duplicated, 0u);
    for (local::Bot* bot : run_->bots()) {
      EXPECT_EQ(bot->client().state(), client::ClientState::kPlaying);
      EXPECT_EQ(bot->client().World().size(), bodies_in_view_);
    }
    EXPECT_EQ(run_->Finish().failure, "");
  }

  std::unique_ptr<local::WorldRun> run_;
  std::size_t bodies_in_view_ = 0;
};

TEST_F(FailoverTest, ANeighbourCarriesAKilledWorkersAreaOn) {
  Start(4, 2);
  ASSERT_TRUE(PlayUntil("all regions protected", [&] { return IsProtected(); }));
  ASSERT_TRUE(PlayOn(1));
  const v1::WorkerReport victim = ReportOf(2);
  ASSERT_EQ(kill(static_cast<pid_t>(victim.identity().pid()), SIGKILL), 0);
  ASSERT_TRUE(PlayUntil("the failover", [&] {
    const v1::Instance instance = run_->Latest();
    return instance.failovers() == 1 && instance.state() == v1::INSTANCE_STATE_RUNNING;
  }));
  EXPECT_EQ(run_->Latest().lost_bodies(), 0u);
  ASSERT_TRUE(PlayOn(2));
  const auto follow = [&] {
    return std::ranges::all_of(run_->bots(), [&](local::Bot* bot) {
      return bot->client().map().version() == MapVersion(run_->Latest().map().version());
    });
  };
  ASSERT_TRUE(PlayUntil("clients with the new map", follow));
  ExpectAllIsThere();
}

// In a local cluster workers end with their agent: killing that is what the end of a host is.
TEST_F(FailoverTest, TheOtherHostCarriesADeadHostsRegionsOn) {
  Start(4, 2);
  ASSERT_TRUE(PlayUntil("all regions protected", [&] { return IsProtected(); }));
  ASSERT_TRUE(PlayOn(1));
  run_->cluster().KillAgent(0);
  ASSERT_TRUE(PlayUntil("the failover", [&] {
    const v1::Instance instance = run_->Latest();
    return instance.failovers() >= 1 && instance.state() == v1::INSTANCE_STATE_RUNNING;
  }));
  EXPECT_EQ(run_->Latest().lost_bodies(), 0u);
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

TEST_F(FailoverTest, TheWorldRunsOnWhileTheControlPlaneIsDead) {
  Start(4, 2);
  ASSERT_TRUE(PlayUntil("all regions protected", [&] { return IsProtected(); }));
  std::map<std::uint32_t, std::int64_t> pids;
  const v1::Instance before = run_->Latest();
  for (const v1::RegionStatus& status : before.region_status()) {
    pids[status.region()] = status.report().identity().pid();
  }
  run_->cluster().KillControl();
  const std::uint64_t killed_at = run_->bots()[0]->client().tick().value();
  ASSERT_TRUE(PlayUntil("the world without a control plane",
                        [&] { return run_->bots()[0]->client().tick().value() > killed_at + 240; }));
  run_->cluster().RestartControl();
  run_->WatchAnew();
  ASSERT_TRUE(PlayOn(2));
  EXPECT_EQ(run_->Latest().failovers(), 0u);
  for (const auto& [region, pid] : pids) EXPECT_EQ(ReportOf(region).identity().pid(), pid) << "region " << region;
  ExpectAllIsThere();
}

TEST_F(FailoverTest, AWorkerThatDiesWhileTheControlPlaneIsDeadIsReplacedWhenItIsBack) {
  Start(4, 2);
  ASSERT_TRUE(PlayUntil("all regions protected", [&] { return IsProtected(); }));
  const auto victim = static_cast<pid_t>(ReportOf(3).identity().pid());
  run_->cluster().KillControl();
  ASSERT_EQ(kill(victim, SIGKILL), 0);
  run_->cluster().RestartControl();
  run_->WatchAnew();
  ASSERT_TRUE(PlayUntil("the failover", [&] {
    const v1::Instance instance = run_->Latest();
    return instance.failovers() == 1 && instance.state() == v1::INSTANCE_STATE_RUNNING;
  }));
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

class GrowthTest : public FailoverTest {
 protected:
  void ScaleTo(std::uint32_t regions) {
    v1::ScaleInstanceRequest request;
    request.set_id(run_->instance_id());
    request.set_regions(regions);
    run_->connection().Call("instance scale", run_->connection().instances(), &v1::InstanceService::Stub::ScaleInstance,
                            request);
    ASSERT_TRUE(PlayUntil("that many regions", [&] {
      const v1::Instance instance = run_->Latest();
      return instance.map().regions_size() == static_cast<int>(regions) && instance.changes().empty() &&
             instance.region_status_size() == static_cast<int>(regions) &&
             std::ranges::all_of(instance.region_status(), [&](const auto& status) {
               return status.report().map_version() == instance.map().version() &&
                      status.report().bodies_outside() == 0;
             });
    }));
  }
};

TEST_F(GrowthTest, FromTwoToFourAndBackUnderLoadNothingIsLost) {
  Start(2, 1, 8);
  ASSERT_TRUE(PlayUntil("all regions protected", [&] { return IsProtected(); }));
  ASSERT_TRUE(PlayOn(1));
  ScaleTo(4);
  ASSERT_TRUE(PlayOn(2));
  ScaleTo(2);
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

}  // namespace
}  // namespace tessera::end_to_end
