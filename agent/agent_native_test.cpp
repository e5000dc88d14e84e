// Native games of a host, by the real agent: which it reports, and the end of a worker that dies in one.
#include <gmock/gmock.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "agent/testing/agent_fixture.h"

namespace tessera::agent {
namespace {

const std::string kBuild(64, 'c');

class AgentNativeTest : public AgentFixture {
 protected:
  AgentNativeTest() {
    std::filesystem::create_directory(games_);
    Write("arena");
  }
  // Whole or not at all, as docs/games.md tells operators.
  void Write(const std::string& name) {
    std::ofstream(games_ + "/new") << "game module " << name << " abi 1 hash " << kBuild << "\n";
    std::filesystem::rename(games_ + "/new", games_ + "/" + name + ".so");
  }

  const std::string games_ = folder_ + "/games";
};

TEST_F(AgentNativeTest, TheHelloNamesAllAndAChangeIsReported) {
  const auto agent = StartAdmitted({"--game-modules", games_});
  const v1::GameModuleList first = control_.record().hellos.at(0).game_modules();
  ASSERT_EQ(first.modules_size(), 1);
  EXPECT_EQ(first.modules(0).name(), "arena");
  EXPECT_EQ(first.modules(0).hash(), kBuild);
  Write("plaza");
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) {
    return !r.module_lists.empty() && r.module_lists.back().modules_size() == 2;
  })) << agent->Output();
  EXPECT_EQ(control_.record().module_lists.back().modules(1).name(), "plaza");
}

TEST_F(AgentNativeTest, WithoutAFolderThereAreNone) {
  const auto agent = StartAdmitted();
  EXPECT_EQ(control_.record().hellos.at(0).game_modules().modules_size(), 0);
}

TEST_F(AgentNativeTest, AWorkerThatDiesInItsGameIsReportedWithThePlace) {
  SetMode(1, "die-in-game");
  const auto agent = StartAdmitted({"--game-modules", games_});
  v1::WorkerOrder order = Order(1);
  order.set_game_native(true);
  order.set_game_name("arena");
  order.set_game_hash(kBuild);
  control_.SetDesired({order});
  ASSERT_TRUE(WaitForExits(1)) << agent->Output();
  const v1::WorkerExited exited = control_.record().exits.at(0);
  EXPECT_EQ(exited.signal(), SIGABRT);
  EXPECT_EQ(exited.died_in_game(), "arena: Aborted in on_tick");
}

}  // namespace
}  // namespace tessera::agent
