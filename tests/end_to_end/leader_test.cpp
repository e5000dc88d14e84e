// Three control planes over one etcd, an agent and a world: leaders are killed, and the world runs on.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "client_sdk/connect/door_session.h"
#include "control_plane/testing/free_address.h"
#include "control_plane/testing/real_etcd.h"
#include "host/child_process.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "host/temporary_folder.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr std::chrono::seconds kPatience{60};
constexpr std::size_t kMaxFileBytes = 4 << 20;

// One of the control planes.
struct Candidate {
  std::string folder, address, players, log;
  std::optional<host::ChildProcess> process;
};

class LeaderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("TESSERA_BIN", TESSERA_BINARY_DIR "/bin", 1);
    setenv("XDG_CONFIG_HOME", folder_.path().c_str(), 1);
    unsetenv("TESSERA_CONTROL");
    unsetenv("TESSERA_TOKEN");
    for (std::size_t i = 0; i < 3; ++i) {
      all_[i].folder = fmt::format("{}/control-{}", folder_.path(), i + 1);
      all_[i].log = all_[i].folder + ".log";
      all_[i].address = control::FreeLoopbackAddress();
      all_[i].players = control::FreeLoopbackAddress();
    }
    Start(all_[0]);
    ASSERT_TRUE(LogHas(all_[0], "elected token="));
    for (std::size_t i = 1; i < 3; ++i) {
      std::filesystem::create_directories(all_[i].folder);
      std::filesystem::copy(all_[0].folder + "/seal.key", all_[i].folder + "/seal.key");
      Start(all_[i]);
    }
    MakeContext();
  }
  void TearDown() override {
    agent_.reset();
    for (Candidate& one : all_) one.process.reset();
  }

  void Start(Candidate& one) {
    const std::string ready = one.folder + ".json";
    auto process = host::ChildProcess::Start(
        {.argv = {support::BinaryPath("tessera-control"), "--listen", one.address, "--players-https", one.players,
                  "--metrics-listen", "127.0.0.1:0", "--state-dir", one.folder, "--ready-file", ready, "--store",
                  "etcd://" + etcd_.endpoint() + "/leader-test", "--checkpoints", folder_.path() + "/checkpoints"},
         .log_path = one.log});
    ASSERT_TRUE(process.ok()) << process.status();
    one.process = *std::move(process);
    ASSERT_TRUE(one.process->WaitForFile(ready, kPatience)) << host::LastLinesText(one.log, 5);
  }
  // The context "all" has the addresses of all three.
  void MakeContext() {
    const support::RunResult made = Tessera(
        {"--control", "unix:" + all_[0].folder + "/control.sock", "cluster", "init", "--address", all_[0].address});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const support::RunResult authority = Tessera({"cluster", "authority"});
    const std::string fingerprint = authority.out.substr(0, 64);
    const auto doors = client::ParseDoorAddresses(
        fmt::format("{1}#{0},{2}#{0},{3}#{0}", fingerprint, all_[2].players, all_[1].players, all_[0].players));
    ASSERT_TRUE(doors.ok()) << doors.status();
    players_ = *doors;
    const support::RunResult token = Tessera({"-o", "json", "token", "create", "all", "--role", "administrator"});
    ASSERT_EQ(token.exit_code, 0) << token.err;
    const std::string file = folder_.path() + "/all.token";
    std::ofstream(file) << nlohmann::json::parse(token.out).at("secret").get<std::string>() << "\n";
    const support::RunResult added =
        Tessera({"context", "add", "all", "--address", Addresses("#" + fingerprint), "--token-file", file});
    ASSERT_EQ(added.exit_code, 0) << added.err;
  }
  // The followers first, so that whoever asks has to look for the leader.
  std::string Addresses(const std::string& after) const {
    return fmt::format("{1}{0},{2}{0},{3}{0}", after, all_[2].address, all_[1].address, all_[0].address);
  }
  // The second time it comes back with the identity that it has.
  void StartAgent() {
    const std::string token = folder_.path() + "/join-token", ready = folder_.path() + "/agent.json";
    if (!std::filesystem::exists(token)) {
      const support::RunResult added = Tessera({"-o", "json", "host", "add", "alpha"});
      ASSERT_EQ(added.exit_code, 0) << added.err;
      std::ofstream(token) << nlohmann::json::parse(added.out).at("join_token").get<std::string>() << "\n";
    }
    std::filesystem::remove(ready);
    const int first = 34'000 + getpid() % 20 * 100;
    auto agent = host::ChildProcess::Start(
        {.argv = {support::BinaryPath("tessera-agent"), "--control", Addresses(""), "--state-dir",
                  folder_.path() + "/agent", "--join-token-file", token, "--metrics-listen", "127.0.0.1:0",
                  "--port-range", fmt::format("{}-{}", first, first + 99), "--capacity", "4", "--ready-file", ready,
                  "--stop-workers", "--die-with-parent"},
         .log_path = AgentLog()});
    ASSERT_TRUE(agent.ok()) << agent.status();
    agent_ = *std::move(agent);
    ASSERT_TRUE(agent_->WaitForFile(ready, kPatience)) << host::LastLinesText(AgentLog(), 5);
  }

  static support::RunResult Tessera(const std::vector<std::string>& arguments) {
    return support::RunProgram("tessera", arguments);
  }
  // Asks again and again until it succeeds; each try takes what a command takes.
  static support::RunResult TesseraUntilDone(const std::vector<std::string>& arguments) {
    const auto until = std::chrono::steady_clock::now() + kPatience;
    support::RunResult result;
    do {
      result = Tessera(arguments);
    } while (result.exit_code != 0 && std::chrono::steady_clock::now() < until);
    return result;
  }
  static bool LogHas(Candidate& one, const std::string& text) {
    const auto until = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < until) {
      if (host::ReadFile(one.log, kMaxFileBytes).value_or("").find(text) != std::string::npos) return true;
      if (one.process->Wait(20ms)) return false;
    }
    return false;
  }
  // The worlds, by the players' door of whichever leads, which opens a moment after it was elected.
  std::vector<client::DoorInstance> WorldsForPlayers() const {
    const auto until = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < until) {
      if (auto listed = client::ListByDoor(players_, 5s); listed.ok()) return *std::move(listed);
    }
    return {};
  }
  static nlohmann::json Describe() {
    const support::RunResult described = TesseraUntilDone({"-o", "json", "instance", "describe", "inst-1"});
    EXPECT_EQ(described.exit_code, 0) << described.err;
    return nlohmann::json::parse(described.out);
  }
  // Tick of the region that is furthest behind; 0: one has not been heard of by this leader.
  static std::uint64_t Tick(const nlohmann::json& instance) {
    std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
    for (const nlohmann::json& region : instance.at("region_status")) {
      const nlohmann::json report = region.value("report", nlohmann::json::object());
      least = std::min<std::uint64_t>(least, std::stoull(report.value("tick", std::string("0"))));
    }
    return least;
  }
  static bool RunsBeyond(std::uint64_t tick) {
    const auto until = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < until) {
      const nlohmann::json instance = Describe();
      if (instance.at("state") == "INSTANCE_STATE_RUNNING" && Tick(instance) > tick) return true;
    }
    return false;
  }
  std::string AgentLog() const { return folder_.path() + "/agent.log"; }

  const host::TemporaryFolder folder_;
  control::RealEtcd etcd_;
  std::array<Candidate, 3> all_;
  std::vector<client::DoorAddress> players_;
  std::optional<host::ChildProcess> agent_;
};

TEST_F(LeaderTest, AWorldRunsOnWhileLeadersDie) {
  StartAgent();
  const support::RunResult running = Tessera(
      {"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies", "50", "--regions", "2", "--wait"});
  ASSERT_EQ(running.exit_code, 0) << running.err;

  std::size_t leader = 0;
  for (int killed = 1; killed <= 2; ++killed) {
    const nlohmann::json before = Describe();
    all_[leader].process->Signal(SIGKILL);
    ASSERT_TRUE(all_[leader].process->Wait(kPatience).has_value());
    // Changes are accepted again, and what was acknowledged before is there.
    const support::RunResult added = TesseraUntilDone({"host", "add", fmt::format("beta-{}", killed)});
    ASSERT_EQ(added.exit_code, 0) << added.err;
    EXPECT_TRUE(RunsBeyond(Tick(before) + 60)) << host::LastLinesText(AgentLog(), 5);
    const nlohmann::json after = Describe();
    EXPECT_EQ(after.value("failovers", 0), 0);
    EXPECT_EQ(after.value("lost_ticks", std::string("0")), "0");
    EXPECT_EQ(after.at("start_time"), before.at("start_time"));
    all_[leader].process.reset();
    // The next one leads now, and says so.
    const std::size_t gone = leader;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      const bool led =
          host::ReadFile(all_[i].log, kMaxFileBytes).value_or("").find("elected token=") != std::string::npos;
      if (all_[i].process && led) leader = i;
    }
    ASSERT_NE(leader, gone);
    const std::vector<client::DoorInstance> worlds = WorldsForPlayers();
    ASSERT_EQ(worlds.size(), 1U);
    EXPECT_EQ(worlds.front().id, "inst-1");
  }
  EXPECT_THAT(Tessera({"host", "list"}).out,
              ::testing::AllOf(HasSubstr("alpha"), HasSubstr("beta-1"), HasSubstr("beta-2")));
  const support::RunResult second = TesseraUntilDone(
      {"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies", "20", "--regions", "1", "--wait"});
  EXPECT_EQ(second.exit_code, 0) << second.err;
}

// The agent has seen the orders of a later leader than all of these.
TEST_F(LeaderTest, AnAgentThatWasStartedAnewTakesNoOrdersOfAnEarlierLeader) {
  StartAgent();
  const auto identity = [&] {
    return nlohmann::json::parse(host::ReadFile(folder_.path() + "/agent/host.json", kMaxFileBytes).value());
  };
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (!identity().contains("newest_life") && std::chrono::steady_clock::now() < until) agent_->Wait(20ms);
  nlohmann::json kept = identity();
  ASSERT_GT(std::stoull(kept.value("newest_life", std::string("0"))), 0u);
  agent_.reset();
  kept["newest_life"] = "1000000";
  std::ofstream(folder_.path() + "/agent/host.json") << kept;
  StartAgent();
  const std::string refused = "newest_life=1000000: of a control plane that was deposed";
  bool found = false;
  while (!found && std::chrono::steady_clock::now() < until + kPatience && !agent_->Wait(20ms)) {
    found = host::ReadFile(AgentLog(), kMaxFileBytes).value_or("").find(refused) != std::string::npos;
  }
  EXPECT_TRUE(found) << host::LastLinesText(AgentLog(), 5);
}

TEST_F(LeaderTest, AFollowerNamesTheLeader) {
  const support::RunResult asked = Tessera({"--control", "unix:" + all_[1].folder + "/control.sock", "host", "list"});
  EXPECT_EQ(asked.exit_code, 1);
  EXPECT_THAT(asked.err, HasSubstr("this control plane does not lead; the leader is " + all_[0].address));
  EXPECT_EQ(Tessera({"host", "list"}).exit_code, 0);
}

}  // namespace
}  // namespace tessera::end_to_end
