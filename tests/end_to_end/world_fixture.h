// WorldTest: a world on a cluster of real processes, with players in it, as the tests of deaths, growth and return
// need it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>

#include "local_cluster/instance_state.h"
#include "local_cluster/world_run.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {

class WorldTest : public testing::Test {
 protected:
  static constexpr std::chrono::seconds kPatience{150};  // which only a failing test waits out
  static constexpr std::uint32_t kBodies = 200, kBots = 2;

  // kBodies and kBots by default.
  void Start(local::RunOptions options) {
    if (options.scene.empty()) options.scene = support::ScenePath("plaza");
    if (!options.bodies) options.bodies = kBodies;
    run_ = std::make_unique<local::WorldRun>(options);
  }
  void Start(std::uint32_t regions, std::uint32_t hosts, std::uint32_t capacity = 0) {
    Start({.scene = "", .regions = regions, .bots = kBots, .hosts = hosts, .capacity = capacity});
  }

  // Plays on until it holds; false, with the state of the instance, if the world or a player ended or time is up.
  testing::AssertionResult PlayUntil(const std::string& what, const std::function<bool()>& holds) {
    if (run_->PlayUntil(holds, kPatience)) return testing::AssertionSuccess();
    return testing::AssertionFailure() << "it ended before, or never: " << what << "\n"
                                       << run_->Latest().ShortDebugString();
  }
  // Every region's standby has followed it for a second, and every player sees all there is: what moves, and the
  // scene's ground and walls.
  testing::AssertionResult PlayUntilProtected() {
    return PlayUntil("all regions protected", [this] {
      const v1::Instance instance = run_->Latest();
      bodies_in_view_ = run_->bots().empty() ? 0 : run_->bots()[0]->client().World().size();
      return instance.state() == v1::INSTANCE_STATE_RUNNING && instance.unprotected_regions().empty() &&
             (run_->bots().empty() || bodies_in_view_ >= kBodies + kBots) &&
             std::ranges::all_of(instance.region_status(),
                                 [](const auto& status) { return status.report().acknowledged_tick() > 60; });
    });
  }
  // `more` complete censuses from now on.
  testing::AssertionResult PlayOn(std::uint64_t more) {
    const auto counted = [&] { return run_->conservation() ? run_->conservation()->censuses : 0; };
    const std::uint64_t before = counted();
    return PlayUntil("further censuses", [&] { return counted() >= before + more; });
  }
  testing::AssertionResult PlayUntilFailedOver(std::uint32_t at_least = 1) {
    return PlayUntil("the failover", [this, at_least] {
      const v1::Instance instance = run_->Latest();
      return instance.failovers() >= at_least && instance.state() == v1::INSTANCE_STATE_RUNNING;
    });
  }
  // Nothing is being changed, and all regions run by the map in force.
  bool IsSettled() {
    const v1::Instance instance = run_->Latest();
    return instance.state() == v1::INSTANCE_STATE_RUNNING && instance.changes().empty() &&
           instance.region_status_size() == instance.map().regions_size() &&
           std::ranges::all_of(instance.region_status(), [&](const auto& status) {
             return status.report().map_version() == instance.map().version() && status.report().bodies_outside() == 0;
           });
  }
  v1::WorkerReport ReportOf(std::uint32_t region) {
    const v1::Instance instance = run_->Latest();
    for (const v1::RegionStatus& status : instance.region_status()) {
      if (status.region() == region) return status.report();
    }
    return {};
  }
  std::map<std::uint32_t, std::int64_t> Pids() {
    std::map<std::uint32_t, std::int64_t> pids;
    const v1::Instance instance = run_->Latest();
    for (const v1::RegionStatus& status : instance.region_status()) {
      pids[status.region()] = status.report().identity().pid();
    }
    return pids;
  }
  // `tessera ARGUMENT...` against this cluster.
  support::RunResult Tessera(std::vector<std::string> arguments, std::chrono::seconds patience = kPatience) {
    arguments.insert(arguments.begin(), {"--control", run_->cluster().control_address()});
    return support::RunProgram("tessera", arguments, patience);
  }

  // No body lost or doubled, and the players are there and see all: and it ends in order.
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

}  // namespace tessera::end_to_end
