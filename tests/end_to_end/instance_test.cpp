// The whole path on real processes: cluster, instance, bots, census, end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "host/process.h"
#include "host/temporary_folder.h"
#include "local_cluster/instance_state.h"
#include "local_cluster/world_run.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

std::vector<pid_t> WorkerPids(const v1::Instance& instance) {
  std::vector<pid_t> pids;
  for (const v1::RegionStatus& region : instance.region_status()) {
    pids.push_back(static_cast<pid_t>(region.report().identity().pid()));
  }
  return pids;
}

TEST(InstanceTest, FourRegionsKeepEveryBodyAndLeaveNothingRunning) {
  local::WorldRun run({.scene = support::ScenePath("plaza"), .regions = 4, .bodies = 200, .bots = 2});
  const std::vector<pid_t> workers = WorkerPids(run.Latest());
  ASSERT_EQ(workers.size(), 4u);
  const auto enough = [&] {
    std::uint64_t handovers = 0, ticks = 0;
    const v1::Instance instance = run.Latest();
    for (const v1::RegionStatus& region : instance.region_status()) {
      handovers += region.report().handovers_in();
      ticks = std::max<std::uint64_t>(ticks, region.report().tick());
    }
    return handovers >= 10 && ticks >= 300;
  };
  ASSERT_TRUE(run.PlayUntil(enough, 100s)) << "too few handovers, or it ended: " << run.Latest().reason();
  for (local::Bot* bot : run.bots()) {
    EXPECT_GE(bot->client().World().size(), 202u) << "every dynamic body is seen";
    EXPECT_EQ(bot->client().Stats().decode_errors, 0u);
    EXPECT_GT(bot->client().last_applied_input(), 0u);
  }
  const local::RunSummary summary = run.Finish();
  EXPECT_EQ(summary.failure, "");
  EXPECT_EQ(summary.conservation->found, summary.bodies_at_start);
  for (const pid_t worker : workers) EXPECT_FALSE(host::IsAlive(worker));
}

TEST(InstanceTest, TheDemoProvesItself) {
  const support::RunResult demo = support::RunProgram(
      "tessera",
      {"demo", "--scene", "plaza", "--seconds", "5", "--bodies", "100", "--regions", "3", "--bots", "2", "-o", "json"},
      120s);
  ASSERT_EQ(demo.exit_code, 0) << demo.err;
  const json summary = json::parse(demo.out);
  EXPECT_EQ(summary.at("lost"), 0);
  EXPECT_EQ(summary.at("duplicated"), 0);
  EXPECT_EQ(summary.at("nonfinite"), 0);
  EXPECT_EQ(summary.at("processes_left"), 0);
  EXPECT_GT(summary.at("censuses"), 0);
  EXPECT_EQ(summary.at("bodies_end"), summary.at("bodies_start"));
  EXPECT_EQ(summary.at("clients").size(), 2u);
}

TEST(InstanceTest, TheDemoSaysFirstWhereItsPageIs) {
  const support::RunResult demo = support::RunProgram(
      "tessera", {"demo", "--scene", "plaza", "--seconds", "4", "--bodies", "20", "--regions", "1", "--bots", "0"},
      120s);
  ASSERT_EQ(demo.exit_code, 0) << demo.err;
  const std::string first = demo.out.substr(0, demo.out.find('\n'));
  static const std::regex kAddress("page: http://127\\.0\\.0\\.1:[0-9]+/#key=[0-9a-f]{64}");
  EXPECT_TRUE(std::regex_match(first, kAddress)) << demo.out;
}

TEST(InstanceTest, TheDemoPlaysTheArena) {
  const support::RunResult demo = support::RunProgram("tessera", {"demo", "--seconds", "8", "-o", "json"}, 120s);
  ASSERT_EQ(demo.exit_code, 0) << demo.err;
  const json summary = json::parse(demo.out);
  EXPECT_EQ(summary.at("lost"), 0);
  EXPECT_EQ(summary.at("duplicated"), 0);
  EXPECT_GT(summary.at("censuses"), 0);
  EXPECT_EQ(summary.at("clients").size(), 4u);
  EXPECT_GT(summary.at("handovers"), 0);
}

TEST(InstanceTest, TheOnlyWorkersDeathFailsItsInstanceWithTheReason) {
  local::WorldRun run({.scene = support::ScenePath("minimal"), .regions = 1, .bots = 0});
  const std::vector<pid_t> workers = WorkerPids(run.Latest());
  ASSERT_EQ(kill(workers[0], SIGKILL), 0);
  EXPECT_FALSE(run.PlayUntil([] { return false; }, 60s));  // ends when the instance does
  const v1::Instance instance = run.Latest();
  EXPECT_EQ(instance.state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(instance.reason(), testing::HasSubstr("region 1"));
  EXPECT_THAT(instance.reason(), testing::HasSubstr("SIGKILL"));
}

TEST(InstanceTest, AWorkerThatEndsAtItsStartFailsTheInstanceAndGivesItsPlacesBack) {
  const host::TemporaryFolder folder;
  const std::string program = folder.path() + "/region";
  std::ofstream(program) << "#!/bin/sh\necho 'no such luck' >&2\nexit 3\n";
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const local::LocalCluster cluster({.state_dir = folder.path(), .region_binary = program});
  const support::RunResult created = support::RunProgram(
      "tessera",
      {"--control", cluster.control_address(), "instance", "create", "--scene", "minimal", "--regions", "2", "--wait"});
  EXPECT_EQ(created.exit_code, 1);
  EXPECT_EQ(std::count(created.err.begin(), created.err.end(), '\n'), 1) << created.err;
  EXPECT_THAT(created.err, testing::HasSubstr("region "));
  EXPECT_THAT(created.err, testing::HasSubstr("local-1"));
  EXPECT_THAT(created.err, testing::HasSubstr("no such luck"));
  const support::RunResult hosts =
      support::RunProgram("tessera", {"--control", cluster.control_address(), "-o", "json", "host", "list"});
  EXPECT_EQ(json::parse(hosts.out).at("hosts").at(0).at("regions"), 0);
}

TEST(InstanceTest, ABodyOfAnotherPlayerCannotBeMoved) {
  local::WorldRun run({.scene = support::ScenePath("plaza"), .regions = 2, .bodies = 10, .bots = 2});
  local::Bot& thief = *run.bots()[0];
  const BodyId foreign = run.bots()[1]->client().own_body();
  std::string detail;
  const auto refused = [&] {
    thief.client().MoveBody(foreign, {1000, 0, 0}, {});
    for (const client::ClientEvent& event : thief.client().Poll(client::Clock::now())) {
      if (event.kind == client::ClientEvent::Kind::kInputRefused && event.body == foreign) detail = event.detail;
    }
    return !detail.empty();
  };
  ASSERT_TRUE(run.PlayUntil(refused, 60s));
  EXPECT_THAT(detail, testing::HasSubstr(std::to_string(foreign.value())));
  EXPECT_THAT(detail, testing::HasSubstr("not player 1's"));
}

TEST(InstanceTest, EveryListingSpeaksJson) {
  const host::TemporaryFolder folder;
  const local::LocalCluster cluster({.state_dir = folder.path()});
  const auto tessera = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--control", cluster.control_address(), "-o", "json"});
    const support::RunResult result = support::RunProgram("tessera", arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out, nullptr, false);
  };
  const json created = tessera({"instance", "create", "--scene", "minimal", "--regions", "2", "--ghost-depth", "2",
                                "--whole-up-to", "0", "--region-threads", "2", "--wait"});
  const std::string id = created.at("id");
  EXPECT_EQ(created.at("state"), "INSTANCE_STATE_RUNNING");
  EXPECT_EQ(created.at("borders").at("ghost_depth"), 2);
  EXPECT_EQ(created.at("borders").at("whole_up_to"), 0);
  EXPECT_EQ(created.at("region_threads"), 2);
  EXPECT_EQ(tessera({"instance", "list"}).at("instances").at(0).at("id"), id);
  EXPECT_EQ(tessera({"instance", "describe", id}).at("region_status").size(), 2u);
  EXPECT_EQ(tessera({"host", "list"}).at("hosts").at(0).at("regions"), 2);
  EXPECT_EQ(tessera({"host", "describe", "local-1"}).at("workers").size(), 2u);
  EXPECT_EQ(tessera({"host", "drain", "local-1"}).at("host").at("state"), "HOST_STATE_DRAINING");
  EXPECT_EQ(tessera({"scene", "validate", support::ScenePath("plaza")}).at(0).at("name"), "plaza");
  EXPECT_EQ(tessera({"instance", "delete", id, "--wait"}).at("state"), "INSTANCE_STATE_ENDED");
  EXPECT_EQ(tessera({"host", "list"}).at("hosts").at(0).at("regions"), 0);
}

}  // namespace
}  // namespace tessera::end_to_end
