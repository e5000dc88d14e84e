// `tessera up`: what one run leaves behind is what the next one begins with, and both say so.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "client_sdk/include/tessera/connect.hpp"
#include "host/temporary_folder.h"
#include "host/testing/watched_program.h"
#include "tests/support/run_program.h"

namespace tessera::programs {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;

class UpTest : public ::testing::Test {
 protected:
  std::vector<std::string> Arguments() const {
    return {support::BinaryPath("tessera"),
            "up",
            "--state-dir",
            state_.path(),
            "--socket",
            state_.path() + "/control.sock",
            "--metrics-listen",
            "127.0.0.1:0",
            "--page-listen",
            "127.0.0.1:0",
            "--visuals",
            visuals_.path(),
            "--capacity",
            "4"};
  }
  // The address of a cluster that is up, from what it printed.
  static std::string ControlOf(const host::WatchedProgram& up) {
    const std::string output = up.Output();
    static const std::regex kLine("control plane +(unix:[^ \n]+)");
    std::smatch match;
    return std::regex_search(output, match, kLine) ? match[1].str() : "";
  }

  const host::TemporaryFolder state_, visuals_;
};

TEST_F(UpTest, TheNextRunBeginsWithTheLastTick) {
  std::string kept;
  {
    host::WatchedProgram up(Arguments());
    ASSERT_TRUE(up.WaitForText("Ctrl-C ends it all."));
    EXPECT_THAT(up.Output(), ::testing::Not(HasSubstr("begins again")));
    const std::string control = ControlOf(up);
    const auto made = support::RunProgram(
        "tessera", {"--control", control, "instance", "create", "--scene", "plaza", "--regions", "2", "--wait"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    up.Signal(SIGINT);
    EXPECT_TRUE(up.Wait().Clean());
    const std::string output = up.Output();
    static const std::regex kLine("inst-1: checkpoint of tick ([0-9]+)\n");
    std::smatch match;
    ASSERT_TRUE(std::regex_search(output, match, kLine)) << output;
    kept = match[1];
  }
  host::WatchedProgram up(Arguments());
  ASSERT_TRUE(up.WaitForText("Ctrl-C ends it all."));
  EXPECT_EQ(up.Output().rfind("page: http://127.0.0.1:", 0), 0u) << "the page's address comes first: " << up.Output();
  EXPECT_THAT(up.Output(), ContainsRegex("inst-1 \\(plaza\\) begins again with its checkpoint of tick " + kept));
  const std::string control = ControlOf(up);
  const auto deleted = support::RunProgram("tessera", {"--control", control, "instance", "delete", "inst-1", "--wait"});
  EXPECT_EQ(deleted.exit_code, 0) << deleted.err;
  up.Signal(SIGTERM);
  EXPECT_TRUE(up.Wait().Clean());
  EXPECT_THAT(up.Output(), ::testing::Not(HasSubstr("checkpoint of tick " + kept + "\n")));
}

// Children of a process by the name of their program.
std::vector<pid_t> ChildrenOf(pid_t parent, const std::string& name) {
  std::vector<pid_t> children;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(parent) + "/task")) {
    std::ifstream list(thread.path() / "children");
    for (pid_t child = 0; list >> child;) {
      std::ifstream comm("/proc/" + std::to_string(child) + "/comm");
      std::string program;
      if (std::getline(comm, program) && program == name) children.push_back(child);
    }
  }
  std::ranges::sort(children);
  return children;
}

TEST_F(UpTest, AControlPlaneThatDiesIsStartedAgainAndTheWorldRunsOnMeanwhile) {
  host::WatchedProgram up(Arguments());
  ASSERT_TRUE(up.WaitForText("Ctrl-C ends it all."));
  const std::string control = ControlOf(up);
  const auto made = support::RunProgram(
      "tessera", {"--control", control, "instance", "create", "--scene", "plaza", "--regions", "2", "--wait"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::vector<pid_t> controls = ChildrenOf(up.pid(), "tessera-control"),
                           agents = ChildrenOf(up.pid(), "tessera-agent");
  ASSERT_EQ(controls.size(), 1U);
  ASSERT_EQ(agents.size(), 1U);
  const std::vector<pid_t> workers = ChildrenOf(agents[0], "tessera-region");
  ASSERT_EQ(workers.size(), 2U);
  for (int death = 1; death <= 2; ++death) {
    ASSERT_EQ(kill(ChildrenOf(up.pid(), "tessera-control").at(0), SIGKILL), 0);
    const auto said = [&] {
      const std::string output = up.Output(),
                        line = "tessera-control: killed by SIGKILL (Killed); it was started again";
      int count = 0;
      for (auto at = output.find(line); at != std::string::npos; at = output.find(line, at + 1)) ++count;
      return count;
    };
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (said() < death && std::chrono::steady_clock::now() < limit) std::this_thread::yield();
    ASSERT_EQ(said(), death) << up.Output();
    const auto listed = support::RunProgram("tessera", {"--control", control, "instance", "list"});
    EXPECT_EQ(listed.exit_code, 0) << listed.err;
    EXPECT_THAT(listed.out, HasSubstr("inst-1"));
  }
  EXPECT_EQ(ChildrenOf(agents[0], "tessera-region"), workers) << "the world ran on";
  const auto deleted = support::RunProgram("tessera", {"--control", control, "instance", "delete", "inst-1", "--wait"});
  EXPECT_EQ(deleted.exit_code, 0) << deleted.err;
  up.Signal(SIGTERM);
  EXPECT_TRUE(up.Wait().Clean());
}

// Its own hosts join by the socket all the same.
TEST_F(UpTest, OpensItsDoorsWhereTold) {
  std::vector<std::string> arguments = Arguments();
  arguments.insert(arguments.end(), {"--listen", "127.0.0.1:0", "--players-https", "127.0.0.1:0", "-o", "json"});
  host::WatchedProgram up(arguments);
  ASSERT_TRUE(up.WaitForText("\"players_https\""));
  const nlohmann::json said = nlohmann::json::parse(up.Output());
  EXPECT_THAT(said.at("operators").get<std::string>(), HasSubstr("127.0.0.1:"));
  EXPECT_THAT(said.at("players_https").get<std::string>(), ContainsRegex("^127\\.0\\.0\\.1:[1-9][0-9]+$"));
  up.Signal(SIGTERM);
  EXPECT_TRUE(up.Wait().Clean());
}

// A game in development joins a real cluster without gRPC: at the socket, and by TLS that knows the authority.
TEST_F(UpTest, AGameInDevelopmentJoinsByItsDoorsInJson) {
  std::vector<std::string> arguments = Arguments();
  arguments.insert(arguments.end(), {"--players-https", "127.0.0.1:0", "-o", "json"});
  host::WatchedProgram up(arguments);
  ASSERT_TRUE(up.WaitForText("\"players_https\""));
  const std::string control = "unix:" + state_.path() + "/control.sock";
  const std::string https = nlohmann::json::parse(up.Output()).at("players_https").get<std::string>();
  const auto authority = support::RunProgram("tessera", {"--control", control, "cluster", "authority"});
  static const std::regex kFingerprint("[0-9a-f]{64}");
  std::smatch fingerprint;
  ASSERT_TRUE(std::regex_search(authority.out, fingerprint, kFingerprint)) << authority.out << authority.err;
  const auto made = support::RunProgram(
      "tessera", {"--control", control, "instance", "create", "--scene", "plaza", "--regions", "2", "--wait"});
  ASSERT_EQ(made.exit_code, 0) << made.err;

  std::uint32_t player = 0;
  for (const std::string& address : {control, https + "#" + fingerprint[0].str()}) {
    std::vector<InstanceInfo> worlds;
    ASSERT_EQ(ListInstances(address, worlds).text, "");
    ASSERT_EQ(worlds.size(), 1U);
    EXPECT_STREQ(worlds[0].id, "inst-1");
    EXPECT_STREQ(worlds[0].scene, "plaza");
    EXPECT_EQ(worlds[0].state, TESSERA_INSTANCE_RUNNING);
    Client client;
    ASSERT_EQ(client.Join({address, "inst-1", "ada"}).text, "");
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (client.state() != TESSERA_PLAYING && std::chrono::steady_clock::now() < limit) {
      ASSERT_EQ(client.Poll().text, "");
      std::this_thread::yield();
    }
    EXPECT_EQ(client.state(), TESSERA_PLAYING);
    EXPECT_STREQ(client.Scene().name, "plaza");
    EXPECT_EQ(client.player(), ++player);
    EXPECT_EQ(client.Leave().text, "") << "the door let the player go";
  }
  const std::string other = https + "#" + std::string(64, 'a');
  Client stranger;
  const Error refused = stranger.Join({other, "inst-1", "ada"});
  EXPECT_EQ(refused.code, TESSERA_UNAUTHENTICATED) << refused.text;
  up.Signal(SIGTERM);
  EXPECT_TRUE(up.Wait().Clean());
}

}  // namespace
}  // namespace tessera::programs
