// Programs of two releases in one cluster: this build's, and those of the release before, whose folder
// TESSERA_OTHER_RELEASE names; `./dev skew` builds them. Without it these tests are skipped.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <iostream>
#include <map>
#include <set>
#include <string>

#include "bench/scrape.h"
#include "host/temporary_folder.h"
#include "local_cluster/connection.h"
#include "telemetry/http_get.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

using ::testing::HasSubstr;

constexpr const char* kOtherRelease = "TESSERA_OTHER_RELEASE";
constexpr double kTicksPerSecond = 60;         // as the scene has it
constexpr std::uint64_t kTicksLookedAt = 600;  // at most, for the longest one

class SkewTest : public WorldTest {
 protected:
  void SetUp() override {
    const char* folder = std::getenv(kOtherRelease);
    if (folder == nullptr || *folder == '\0') {
      GTEST_SKIP() << kOtherRelease << " names no folder with the programs of another release; ./dev skew builds them";
    }
    other_ = folder;
  }

  local::RunOptions World(const std::string& control_programs, const std::string& agent_programs) const {
    return {.scene = "",
            .regions = 4,
            .bots = kBots,
            .hosts = 2,
            .capacity = 8,
            .control_programs = control_programs,
            .agent_programs = agent_programs};
  }
  // A cluster is good for this: a world runs, is carried on where a worker dies, and is kept.
  void ExpectTheyWorkTogether() {
    ASSERT_TRUE(PlayUntilProtected());
    ASSERT_TRUE(PlayOn(1));
    ASSERT_EQ(kill(static_cast<pid_t>(ReportOf(1).identity().pid()), SIGKILL), 0);
    ASSERT_TRUE(PlayUntilFailedOver());
    EXPECT_EQ(run_->Latest().lost_bodies(), 0u);
    ASSERT_TRUE(PlayUntil("a new worker in its place", [&] { return IsSettled() && run_->Latest().regions() == 4; }));
    const auto kept = Tessera({"instance", "checkpoint", run_->instance_id()});
    EXPECT_EQ(kept.exit_code, 0) << kept.err;
    ASSERT_TRUE(PlayOn(2));
    ASSERT_TRUE(PlayUntilProtected());
    ExpectAllIsThere();
  }
  // By the programs that they say they are.
  std::set<std::string> VersionsOfHosts() {
    local::Connection& connection = run_->connection();
    const auto listed = connection.Call("host list", connection.hosts(), &v1::HostService::Stub::ListHosts, {});
    std::set<std::string> versions;
    for (const v1::Host& host : listed.hosts()) versions.insert(host.version());
    return versions;
  }
  // The longest that any region had in the last five to ten seconds.
  double LongestTickSeconds() {
    double longest = 0;
    const v1::Instance instance = run_->Latest();
    for (const v1::RegionStatus& status : instance.region_status()) {
      const v1::RegionAddress& at = status.report().address();
      const auto page = telemetry::HttpGet(at.host() + ":" + std::to_string(at.metrics_port()), "/metrics");
      if (!page.ok()) continue;
      const bench::Samples samples = bench::ParseMetrics(page->body);
      const auto found = samples.find("tessera_region_longest_tick_seconds");
      if (found != samples.end()) longest = std::max(longest, found->second);
    }
    return longest;
  }

  std::string other_;
};

TEST_F(SkewTest, AgentsOfTheReleaseBeforeServeThisControlPlane) {
  Start(World("", other_));
  ExpectTheyWorkTogether();
}

TEST_F(SkewTest, AgentsOfThisReleaseServeTheControlPlaneBefore) {
  Start(World(other_, ""));
  ExpectTheyWorkTogether();
}

TEST_F(SkewTest, ThisCommandLineManagesTheControlPlaneBefore) {
  local::RunOptions options = World(other_, other_);
  options.bots = 0;
  Start(options);
  ASSERT_TRUE(PlayUntilProtected());
  const std::string& id = run_->instance_id();
  const auto hosts = Tessera({"host", "list"});
  EXPECT_EQ(hosts.exit_code, 0) << hosts.err;
  EXPECT_THAT(hosts.out, HasSubstr("local-2"));
  const auto listed = Tessera({"instance", "list"});
  EXPECT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_THAT(listed.out, HasSubstr(id));
  const auto described = Tessera({"instance", "describe", id});
  EXPECT_EQ(described.exit_code, 0) << described.err;
  EXPECT_THAT(described.out, HasSubstr("RUNNING"));
  for (const char* order : {"pause", "resume", "checkpoint", "delete"}) {
    const auto done = Tessera({"instance", order, id});
    EXPECT_EQ(done.exit_code, 0) << order << ": " << done.err;
  }
}

// One program after the other, while two players play. Workers keep the program that they were started with.
TEST_F(SkewTest, AClusterIsUpgradedProgramByProgramUnderAMatch) {
  local::RunOptions options = World(other_, other_);
  options.hosts = 3;
  options.workers_outlive_agents = true;
  Start(options);
  ASSERT_TRUE(PlayUntilProtected());
  const std::uint64_t begun = ReportOf(1).tick();
  ASSERT_TRUE(PlayUntil("its first ticks are none of those that are looked at",
                        [&] { return ReportOf(1).tick() > begun + kTicksLookedAt; }));
  const std::map<std::uint32_t, std::int64_t> pids = Pids();
  const double before_s = LongestTickSeconds();
  local::LocalCluster& cluster = run_->cluster();
  cluster.KillControl();
  cluster.UseControlPrograms("");
  cluster.RestartControl();
  run_->WatchAnew();
  ASSERT_TRUE(PlayOn(2)) << "the new control plane, and agents of the release before";
  double longest_s = LongestTickSeconds();
  for (std::size_t host = 0; host < options.hosts; ++host) {
    cluster.KillAgent(host);
    cluster.UseAgentPrograms(host, "");
    cluster.RestartAgent(host);
    ASSERT_TRUE(PlayOn(2)) << "host " << host + 1 << " of " << options.hosts;
    longest_s = std::max(longest_s, LongestTickSeconds());
  }
  EXPECT_EQ(VersionsOfHosts().size(), 1u);
  EXPECT_EQ(Pids(), pids) << "a worker was replaced";
  EXPECT_EQ(run_->Latest().failovers(), 0u);
  const double ticks = longest_s * kTicksPerSecond;
  std::cout << "longest tick: " << ticks << " ticks, before " << before_s * kTicksPerSecond << "\n";
  RecordProperty("longest_tick_ticks", std::to_string(ticks));
  ExpectAllIsThere();
}

// Workers of the release before run on under agents of this one, which keep its program.
TEST_F(SkewTest, AWorldKeepsItsReleaseUntilItIsUpgraded) {
  const host::TemporaryFolder releases;
  local::RunOptions options = World("", other_);
  options.workers_outlive_agents = true;
  options.release_programs = releases.path();
  Start(options);
  ASSERT_TRUE(PlayUntilProtected());
  const std::set<std::string> before = VersionsOfHosts();
  ASSERT_EQ(before.size(), 1u);
  const std::string old_release = *before.begin();
  EXPECT_EQ(run_->Latest().release(), old_release);
  std::filesystem::create_directory(releases.path() + "/" + old_release);
  std::filesystem::create_symlink(other_ + "/tessera-region", releases.path() + "/" + old_release + "/tessera-region");
  for (std::size_t host = 0; host < options.hosts; ++host) {
    run_->cluster().KillAgent(host);
    run_->cluster().UseAgentPrograms(host, "");
    run_->cluster().RestartAgent(host);
    ASSERT_TRUE(PlayOn(1));
  }
  ASSERT_TRUE(PlayUntilProtected());
  ASSERT_EQ(kill(static_cast<pid_t>(ReportOf(1).identity().pid()), SIGKILL), 0);
  ASSERT_TRUE(PlayUntilFailedOver());
  ASSERT_TRUE(PlayUntil("a new worker of the old release in its place",
                        [&] { return IsSettled() && run_->Latest().regions() == 4; }));
  EXPECT_EQ(run_->Latest().release(), old_release);
  ASSERT_TRUE(PlayOn(1));

  const std::map<std::uint32_t, std::int64_t> pids = Pids();
  const std::string new_release = *VersionsOfHosts().begin();
  EXPECT_THAT(Tessera({"instance", "describe", run_->instance_id()}).out, HasSubstr("Release:  " + old_release + "\n"));
  EXPECT_THAT(Tessera({"host", "describe", "local-1"}).out,
              HasSubstr("Worker programs of releases " + old_release + ", " + new_release + "\n"));
  auto upgraded = std::async(std::launch::async, [&] { return Tessera({"instance", "upgrade", run_->instance_id()}); });
  ASSERT_TRUE(
      PlayUntil("upgraded", [&] { return upgraded.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }));
  const support::RunResult result = upgraded.get();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  ASSERT_TRUE(PlayUntil("other workers", [&] {
    const auto now = Pids();
    return IsSettled() && std::ranges::none_of(pids, [&](const auto& old) {
             const auto found = now.find(old.first);
             return found != now.end() && found->second == old.second;
           });
  }));
  EXPECT_EQ(run_->Latest().release(), new_release);
  EXPECT_NE(new_release, old_release);
  EXPECT_EQ(run_->Latest().lost_ticks(), 0u);
  ASSERT_TRUE(PlayUntilProtected());
  for (local::Bot* bot : run_->bots()) EXPECT_EQ(bot->client().state(), client::ClientState::kPlaying);
}

}  // namespace
}  // namespace tessera::end_to_end
