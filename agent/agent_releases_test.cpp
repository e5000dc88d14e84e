// Workers of another release than the agent's, by the real agent.
#include <gmock/gmock.h>

#include <filesystem>
#include <string>
#include <vector>

#include "agent/testing/agent_fixture.h"

namespace tessera::agent {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class AgentReleasesTest : public AgentFixture {
 protected:
  AgentReleasesTest() {
    std::filesystem::create_directories(releases_ + "/0.0.7");
    std::filesystem::create_symlink(TESSERA_BINARY_DIR "/tests/agent_fake_worker", releases_ + "/0.0.7/tessera-region");
  }
  static std::vector<std::string> ReleasesOf(const v1::AgentHello& hello) {
    return {hello.releases().begin(), hello.releases().end()};
  }

  const std::string releases_ = folder_ + "/releases";
};

TEST_F(AgentReleasesTest, TheHelloNamesAllAndAWorldOfAnEarlierOneGetsItsProgram) {
  // A program that would never attach, for those of the agent's own release.
  const auto agent = StartAdmitted({"--release-programs", releases_, "--region-binary", "/bin/false"});
  const v1::AgentHello hello = control_.record().hellos.at(0);
  EXPECT_THAT(ReleasesOf(hello), SizeIs(2));
  EXPECT_THAT(ReleasesOf(hello), Contains("0.0.7"));
  EXPECT_THAT(ReleasesOf(hello), Contains(hello.version()));
  v1::WorkerOrder order = Order(1);
  order.set_release("0.0.7");
  control_.SetDesired({order});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING)) << agent->Output();
}

TEST_F(AgentReleasesTest, AReleaseThatIsNotHereIsAnExitThatSaysSo) {
  const auto agent = StartAdmitted({"--release-programs", releases_});
  v1::WorkerOrder order = Order(1);
  order.set_release("0.0.6");
  control_.SetDesired({order});
  ASSERT_TRUE(WaitForExits(1)) << agent->Output();
  const v1::WorkerExited exited = control_.record().exits.at(0);
  EXPECT_FALSE(exited.started());
  EXPECT_THAT(exited.reason(), HasSubstr("no worker program of release 0.0.6 in " + releases_));
}

TEST_F(AgentReleasesTest, AnOrderNamesNoOtherFolder) {
  const auto agent = StartAdmitted({"--release-programs", releases_});
  v1::WorkerOrder order = Order(1);
  order.set_release("../../bin");
  control_.SetDesired({order});
  ASSERT_TRUE(WaitForExits(1)) << agent->Output();
  EXPECT_THAT(control_.record().exits.at(0).reason(), HasSubstr("order: release must be three numbers"));
}

}  // namespace
}  // namespace tessera::agent
