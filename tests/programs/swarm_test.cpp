// `tessera swarm`: many players in one process, what it says of them, and what it does when they do not get in; and the
// pace of `tessera client`, which is held against it.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/temporary_folder.h"
#include "local_cluster/local_cluster.h"
#include "tests/support/run_program.h"

namespace tessera::programs {
namespace {

using support::RunProgram;
using support::RunResult;
using ::testing::HasSubstr;

class SwarmTest : public ::testing::Test {
 protected:
  RunResult Tessera(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"--control", cluster_.control_address()});
    return RunProgram("tessera", arguments);
  }

  const host::TemporaryFolder state_;
  const local::LocalCluster cluster_{{.state_dir = state_.path(), .capacity = 4}};
};

TEST_F(SwarmTest, PlayersComeInMoveAndLeave) {
  ASSERT_EQ(Tessera({"instance", "create", "--scene", "plaza", "--regions", "2", "--wait"}).exit_code, 0);
  const RunResult run = Tessera({"-o", "json", "swarm", "inst-1", "--players", "5", "--rate", "20", "--seconds", "3"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto report = nlohmann::json::parse(run.out);
  EXPECT_EQ(report.at("players_joined"), 5);
  EXPECT_GT(report.at("polls"), 0);
  EXPECT_GT(report.at("bytes_in"), 0);
  EXPECT_GT(report.at("cpu_seconds"), 0.0);
  EXPECT_GE(report.at("late_share"), 0.0);
  EXPECT_LE(report.at("late_share"), 1.0);
  // All have left: the next ones are counted from 0.
  const RunResult described = Tessera({"-o", "json", "instance", "describe", "inst-1"});
  EXPECT_EQ(nlohmann::json::parse(described.out).at("players"), 0) << described.out;
}

TEST_F(SwarmTest, AClientKeepsTheSamePace) {
  ASSERT_EQ(Tessera({"instance", "create", "--scene", "plaza", "--regions", "1", "--wait"}).exit_code, 0);
  const RunResult run =
      Tessera({"-o", "json", "client", "inst-1", "--rate", "20", "--predict", "--seconds", "3", "--name", "ada"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto report = nlohmann::json::parse(run.out);
  EXPECT_GT(report.at("bytes_in"), 0);
  // Fewer frames if the machine is busy, but no more than were asked for.
  const double frames = report.at("frame_time").at("count");
  EXPECT_GT(frames, 0);
  EXPECT_LE(frames, 20 * 3 + 2);
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {"--rate", "0"}, {"--rate", "nan"}, {"--rate", "241"}, {"--play", "a.rec", "--predict"}}) {
    std::vector<std::string> arguments{"client"};
    if (wrong[0] != "--play") arguments.emplace_back("inst-1");
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    EXPECT_EQ(Tessera(arguments).exit_code, 2) << wrong[0] << " " << wrong[1];
  }
}

TEST_F(SwarmTest, SaysWhyPlayersDoNotGetIn) {
  const RunResult nowhere = Tessera({"swarm", "inst-7", "--players", "3"});
  EXPECT_EQ(nowhere.exit_code, 1);
  EXPECT_THAT(nowhere.err, HasSubstr("tessera: swarm: "));
  EXPECT_THAT(nowhere.err, HasSubstr("inst-7"));
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {"--players", "0"}, {"--players", "10001"}, {"--rate", "0"}, {"--rate", "nan"}, {"--seconds", "-1"}}) {
    std::vector<std::string> arguments{"swarm", "inst-1"};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    EXPECT_EQ(Tessera(arguments).exit_code, 2) << wrong[0] << " " << wrong[1];
  }
}

}  // namespace
}  // namespace tessera::programs
