#include "agent/options.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

#include "agent/limits.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "trust/control_address.h"

namespace tessera::agent {
namespace {

using ::testing::HasSubstr;

absl::StatusOr<AgentOptions> Parse(std::vector<std::string> flags) {
  flags.insert(flags.begin(), "tessera-agent");
  std::vector<char*> argv;
  argv.reserve(flags.size());
  for (std::string& flag : flags) argv.push_back(flag.data());
  return ParseOptions(static_cast<int>(argv.size()), argv.data());
}

TEST(OptionsTest, DefaultsFitOneMachine) {
  const AgentOptions options = Parse({}).value();
  EXPECT_EQ(options.control, "unix:" + trust::DefaultControlSocket());
  EXPECT_EQ(options.bind_address, "127.0.0.1");
  EXPECT_EQ(options.metrics_port, 7702);
  EXPECT_EQ(options.ports.ToString(), "7800-8799");
  EXPECT_EQ(options.capacity % 8, 0U);
  EXPECT_THAT(options.region_binary, ::testing::EndsWith("/tessera-region"));
  EXPECT_FALSE(options.stop_workers);
  EXPECT_TRUE(options.worker_sandbox);
  EXPECT_GE(options.worker_memory_mb, kLeastWorkerMemory_mb);
  EXPECT_DOUBLE_EQ(options.certificate_life_s, 90 * 86'400);
}

TEST(OptionsTest, ControlGroupsOfWorkersAreOffUnlessToldAndThenHaveAnEnd) {
  EXPECT_FALSE(Parse({})->worker_cgroups);
  const AgentOptions options = Parse({"--worker-cgroups", "on", "--worker-tasks", "64"}).value();
  EXPECT_TRUE(options.worker_cgroups);
  EXPECT_EQ(options.worker_tasks, 64U);
  EXPECT_EQ(Parse({"--worker-cgroups", "on"})->worker_tasks, kUsualWorkerTasks);
  EXPECT_FALSE(Parse({"--worker-tasks", "40000"}).ok());
}

TEST(OptionsTest, TheFolderOfNativeGamesMustBeThere) {
  EXPECT_EQ(Parse({})->game_modules, "");
  EXPECT_EQ(Parse({"--game-modules", "/tmp/../tmp"})->game_modules, "/tmp");
  EXPECT_EQ(Parse({"--game-modules", "/nowhere"}).status().message(), "--game-modules /nowhere: no such folder");
}

TEST(OptionsTest, ProgramsOfOtherReleasesAreBesideTheOwnOnesUnlessAFolderIsGiven) {
  const AgentOptions options = Parse({}).value();
  EXPECT_THAT(options.release_programs, ::testing::EndsWith("/lib/tessera/releases"));
  EXPECT_FALSE(options.region_binary_given);
  EXPECT_EQ(Parse({"--release-programs", "/tmp/../tmp"})->release_programs, "/tmp");
  EXPECT_TRUE(Parse({"--region-binary", "/bin/true"})->region_binary_given);
  EXPECT_EQ(Parse({"--release-programs", "/nowhere"}).status().message(),
            "--release-programs /nowhere: no such folder");
}

TEST(OptionsTest, ListensEverywhereOnceOthersAreToReachIt) {
  EXPECT_EQ(Parse({"--advertise-address", "10.1.2.3"})->bind_address, "0.0.0.0");
  EXPECT_EQ(Parse({"--advertise-address", "localhost"})->bind_address, "127.0.0.1");
  EXPECT_EQ(Parse({"--advertise-address", "10.1.2.3", "--bind-address", "10.1.2.3"})->bind_address, "10.1.2.3");
}

// A service at loopback, or everywhere, is found at the advertised address or not at all.
TEST(OptionsTest, MetricsAreFoundWhereTheyAreServed) {
  for (const char* none : {"127.0.0.1", "127.0.0.9", "localhost", "::1", "0.0.0.0", "::"}) {
    EXPECT_EQ(MetricsAddressOfHost(none), "") << none;
  }
  EXPECT_EQ(MetricsAddressOfHost("10.9.0.2"), "10.9.0.2");
  EXPECT_EQ(MetricsAddressOfHost("metrics.example"), "metrics.example");
  EXPECT_EQ(Parse({"--advertise-address", "10.1.2.3"})->metrics_host, "127.0.0.1") << "not where players come";
}

TEST(OptionsTest, BadValuesNameTheirFlag) {
  const std::vector<std::vector<std::string>> bad = {{"--control", "nowhere"},       {"--metrics-listen", "7702"},
                                                     {"--port-range", "5"},          {"--advertise-address", "a b"},
                                                     {"--bind-address", "hostname"}, {"--capacity", "10001"},
                                                     {"--worker-memory-mb", "100"},  {"--worker-sandbox", "maybe"}};
  for (const auto& flags : bad) {
    const auto options = Parse(flags);
    EXPECT_EQ(options.status().code(), absl::StatusCode::kInvalidArgument) << flags[0];
    EXPECT_THAT(std::string(options.status().message()), HasSubstr(flags[0]));
  }
  EXPECT_THAT(std::string(Parse({"--no-such-flag"}).status().message()), HasSubstr("--no-such-flag"));
  EXPECT_THAT(std::string(Parse({"--capacity", "many"}).status().message()), HasSubstr("--capacity"));
  EXPECT_THAT(std::string(Parse({"--join-token", "a", "--join-token-file", "b"}).status().message()),
              HasSubstr("--join-token"));
  EXPECT_THAT(std::string(Parse({"--capacity", "4", "--port-range", "7800-7808"}).status().message()),
              HasSubstr("room for 3 workers"));
}

TEST(OptionsTest, TokenComesFromFileThenFlagThenEnvironment) {
  setenv("TESSERA_JOIN_TOKEN", "from-environment", 1);
  EXPECT_EQ(ReadJoinToken(*Parse({})).value(), "from-environment");
  EXPECT_EQ(ReadJoinToken(*Parse({"--join-token", "from-flag"})).value(), "from-flag");
  const std::string path = ::testing::TempDir() + "/tessera-token-" + std::to_string(getpid());
  std::ofstream(path) << " from-file \n";
  EXPECT_EQ(ReadJoinToken(*Parse({"--join-token-file", path})).value(), "from-file");
  std::remove(path.c_str());
  unsetenv("TESSERA_JOIN_TOKEN");
  EXPECT_EQ(ReadJoinToken(*Parse({})).value(), "");
}

TEST(OptionsTest, TokenFileIsReadOnlyWhenItIsNeeded) {
  for (const std::string path : {"/no/file", "/dev/null"}) {
    const auto options = Parse({"--join-token-file", path});
    ASSERT_TRUE(options.ok()) << options.status();
    const absl::Status status = ReadJoinToken(*options).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr("--join-token-file " + path));
  }
}

}  // namespace
}  // namespace tessera::agent
