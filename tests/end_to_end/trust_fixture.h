// TrustTest: a cluster that is reached over the network, made as operators make one, with its first administrator.
#pragma once

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/child_process.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "host/temporary_folder.h"
#include "telemetry/http_get.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {

class TrustTest : public ::testing::Test {
 protected:
  static constexpr std::chrono::seconds kPatience{60};
  static constexpr std::size_t kMaxFileBytes = 1 << 20;
  static constexpr char kRenewed[] = "certificate renewed";

  void SetUp() override {
    setenv("TESSERA_BIN", TESSERA_BINARY_DIR "/bin", 1);
    setenv("XDG_CONFIG_HOME", folder_.path().c_str(), 1);
    unsetenv("TESSERA_CONTROL");
    unsetenv("TESSERA_TOKEN");
    StartControl("127.0.0.1:0", "127.0.0.1:0");
    const support::RunResult made = Tessera({"--control", socket_, "cluster", "init", "--address", operators_});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    fingerprint_ = FirstLine(Tessera({"cluster", "authority"}));
    ASSERT_EQ(fingerprint_.size(), 64u);
    EXPECT_THAT(made.out, ::testing::HasSubstr(fingerprint_));
  }
  void TearDown() override {
    second_agent_.reset();
    agent_.reset();
    control_.reset();
  }

  void StartControl(const std::string& operators, const std::string& players) {
    const std::string ready = folder_.path() + "/control.json";
    std::filesystem::remove(ready);
    auto control = host::ChildProcess::Start(
        {.argv = {support::BinaryPath("tessera-control"), "--listen", operators, "--players-listen", players,
                  "--metrics-listen", "127.0.0.1:0", "--state-dir", folder_.path() + "/control", "--ready-file", ready},
         .log_path = ControlLog()});
    ASSERT_TRUE(control.ok()) << control.status();
    control_ = *std::move(control);
    ASSERT_TRUE(control_->WaitForFile(ready, kPatience)) << host::LastLinesText(ControlLog(), 5);
    const auto addresses = nlohmann::json::parse(*host::ReadFile(ready, kMaxFileBytes));
    socket_ = addresses.at("socket");
    operators_ = addresses.at("grpc");
    players_ = addresses.at("players");
    http_ = addresses.at("http");
  }
  // An agent that joins by TLS, or has joined: until it is admitted, or has ended.
  bool StartAgent(const std::string& token, const std::vector<std::string>& more = {}) {
    return LaunchAgent(agent_, "agent", 0, token, more);
  }
  bool StartSecondAgent(const std::string& token, const std::vector<std::string>& more = {}) {
    return LaunchAgent(second_agent_, "second", 1, token, more);
  }
  // `name`: of its state folder and its log; `number`: of its ports.
  bool LaunchAgent(std::optional<host::ChildProcess>& process, const std::string& name, int number,
                   const std::string& token, const std::vector<std::string>& more) {
    const std::string ready = folder_.path() + "/" + name + ".json";
    std::filesystem::remove(ready);
    const std::string token_file = folder_.path() + "/join-token";
    std::ofstream(token_file) << token << "\n";
    const int first = 30'000 + (getpid() % 20 * 2 + number) * 100;
    std::vector<std::string> argv = {support::BinaryPath("tessera-agent"),
                                     "--control",
                                     operators_,
                                     "--state-dir",
                                     folder_.path() + "/" + name,
                                     "--join-token-file",
                                     token_file,
                                     "--metrics-listen",
                                     "127.0.0.1:0",
                                     "--port-range",
                                     fmt::format("{}-{}", first, first + 99),
                                     "--capacity",
                                     "4",
                                     "--ready-file",
                                     ready,
                                     "--stop-workers",
                                     "--die-with-parent"};
    argv.insert(argv.end(), more.begin(), more.end());
    auto agent = host::ChildProcess::Start({.argv = argv, .log_path = folder_.path() + "/" + name + ".log"});
    EXPECT_TRUE(agent.ok()) << agent.status();
    process = *std::move(agent);
    return process->WaitForFile(ready, kPatience);
  }
  std::string JoinToken(const std::string& name) {
    const support::RunResult added = Tessera({"-o", "json", "host", "add", name});
    EXPECT_EQ(added.exit_code, 0) << added.err;
    return nlohmann::json::parse(added.out).at("join_token");
  }
  // A context of somebody with a new token of that role; what follows `--context NAME` is theirs.
  void AddPerson(const std::string& name, const std::string& role) {
    const support::RunResult created = Tessera({"-o", "json", "token", "create", name, "--role", role});
    ASSERT_EQ(created.exit_code, 0) << created.err;
    const std::string file = folder_.path() + "/" + name + ".token";
    std::ofstream(file) << nlohmann::json::parse(created.out).at("secret").get<std::string>() << "\n";
    const support::RunResult added =
        Tessera({"context", "add", name, "--address", operators_ + "#" + fingerprint_, "--token-file", file});
    ASSERT_EQ(added.exit_code, 0) << added.err;
    ASSERT_EQ(Tessera({"context", "use", "admin"}).exit_code, 0);
  }

  static support::RunResult Tessera(const std::vector<std::string>& arguments) {
    return support::RunProgram("tessera", arguments);
  }
  static std::string FirstLine(const support::RunResult& result) {
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out.substr(0, result.out.find('\n'));
  }
  // The control plane's metrics say how far the clock of host "alpha" is ahead: of its newest agent, once that has sent
  // a heartbeat and a second has passed. The last value, or the first one within a minute of `expected`.
  double SecondsAhead(double expected) const {
    const std::string name = "tessera_control_host_clock_ahead_seconds{host=\"alpha\"} ";
    const auto patience_ends = std::chrono::steady_clock::now() + kPatience;
    double ahead = std::nan("");
    while (!(std::abs(ahead - expected) < 60) && std::chrono::steady_clock::now() < patience_ends) {
      const auto page = telemetry::HttpGet(http_, "/metrics");
      const std::size_t at = page.ok() ? page->body.find(name) : std::string::npos;
      if (at != std::string::npos) ahead = std::stod(page->body.substr(at + name.size()));
    }
    return ahead;
  }
  // Until the agent has renewed its certificate so often; its metrics at the last look.
  std::string AwaitRenewals(std::size_t times) const {
    const std::string metrics =
        nlohmann::json::parse(*host::ReadFile(folder_.path() + "/agent.json", kMaxFileBytes)).at("metrics");
    const auto patience_ends = std::chrono::steady_clock::now() + kPatience;
    std::size_t renewed = 0;
    std::string page;
    while (renewed < times && std::chrono::steady_clock::now() < patience_ends) {
      page = telemetry::HttpGet(metrics, "/metrics").value().body;
      const std::string log = *host::ReadFile(AgentLog(), kMaxFileBytes);
      renewed = 0;
      for (auto at = log.find(kRenewed); at != std::string::npos; at = log.find(kRenewed, at + 1)) ++renewed;
    }
    EXPECT_GE(renewed, times) << host::LastLinesText(AgentLog(), 5);
    return page;
  }
  // Until the agent has the list of revocations with this number on its disk.
  void AwaitKeptRevocations(int number) const {
    const std::string kept = fmt::format("revocations kept number={}", number);
    const auto patience_ends = std::chrono::steady_clock::now() + kPatience;
    std::string log;
    while (log.find(kept) == std::string::npos && std::chrono::steady_clock::now() < patience_ends) {
      log = *host::ReadFile(AgentLog(), kMaxFileBytes);
    }
    EXPECT_NE(log.find(kept), std::string::npos) << host::LastLinesText(AgentLog(), 5);
  }
  std::string ControlLog() const { return folder_.path() + "/control.log"; }
  std::string AgentLog() const { return folder_.path() + "/agent.log"; }
  std::string Everything() const {
    return *host::ReadFile(ControlLog(), kMaxFileBytes) + *host::ReadFile(AgentLog(), kMaxFileBytes);
  }

  const host::TemporaryFolder folder_;
  std::optional<host::ChildProcess> control_, agent_, second_agent_;
  std::string socket_, operators_, players_, http_, fingerprint_;
};

}  // namespace tessera::end_to_end
