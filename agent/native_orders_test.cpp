// How a supervisor carries out orders for workers that run a native game, and how such workers die.
#include <gmock/gmock.h>

#include <csignal>

#include "agent/supervisor.h"

namespace tessera::agent {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class NativeOrdersTest : public ::testing::Test {
 protected:
  NativeOrdersTest() {
    order_.set_revision(1);
    order_.set_instance_id("inst-1");
    order_.set_region(1);
    order_.set_incarnation(11);
    order_.set_scene_hash(std::string(64, 'a'));
    order_.set_game_hash(std::string(64, 'b'));
    order_.set_game_name("arena");
    order_.set_game_native(true);
  }
  // All actions, each of which succeeds.
  void Carry() {
    for (const Action& action : supervisor_.TakeActions()) {
      if (const auto* fetch = std::get_if<FetchContent>(&action)) fetched_.push_back(fetch->content);
      if (const auto* send = std::get_if<SendOrder>(&action)) orders_.push_back(send->order);
      if (const auto* exit = std::get_if<ReportExit>(&action)) exits_.push_back(exit->exited);
      if (const auto* spawn = std::get_if<SpawnWorker>(&action)) {
        supervisor_.Spawned(spawn->key, kPid, 7, "log", TimePoint());
      }
    }
  }
  void Start() {
    v1::DesiredSet set;
    set.set_revision(1);
    *set.add_workers() = order_;
    supervisor_.Desired(set, TimePoint());
    Carry();
  }
  void End(const host::ExitStatus& status, std::vector<std::string> lines) {
    supervisor_.Ended(KeyOf(identity()), status, std::move(lines));
    Carry();
  }
  static v1::WorkerIdentity identity() {
    v1::WorkerIdentity identity = IdentityOf({"inst-1", 1, 11});
    identity.set_pid(kPid);
    return identity;
  }

  static constexpr pid_t kPid = 77;
  v1::WorkerOrder order_;
  std::vector<Content> fetched_;
  std::vector<v1::WorkerOrder> orders_;
  std::vector<v1::WorkerExited> exits_;
  Supervisor supervisor_{PortRange(7800, 8799), [](std::uint16_t) { return true; }};
};

TEST_F(NativeOrdersTest, TheGameIsTakenFromTheHostsFolderAndNotFetched) {
  supervisor_.SetModuleFolder("/games");
  Start();
  ASSERT_EQ(fetched_.size(), 1U);
  EXPECT_EQ(fetched_[0].kind, ContentKind::kScene);
  supervisor_.ContentReady(fetched_[0], "/scene.pb");
  v1::WorkerReport report;
  *report.mutable_identity() = identity();
  ASSERT_TRUE(supervisor_.Attached(report, static_cast<pid_t>(report.identity().pid())).ok());
  Carry();
  ASSERT_EQ(orders_.size(), 1U);
  EXPECT_EQ(orders_[0].game_path(), "/games/arena.so");
}

TEST_F(NativeOrdersTest, AMovementIsTakenFromTheHostsFolderBesideAGameThatIsFetched) {
  order_.set_game_native(false);
  order_.set_game_name("drive.lua");
  order_.set_movement_name("car");
  order_.set_movement_hash(std::string(64, 'd'));
  Start();
  ASSERT_EQ(exits_.size(), 1U);
  EXPECT_EQ(exits_[0].reason(), "this host's agent has no --game-modules, and the world runs native:car@dddddddd");
  supervisor_.SetModuleFolder("/games");
  order_.set_incarnation(12);
  order_.set_movement_hash("feed");
  Start();
  ASSERT_EQ(exits_.size(), 2U);
  EXPECT_EQ(exits_[1].reason(), "order: movement_hash must be 64 hexadecimal digits");
  order_.set_incarnation(13);
  order_.set_movement_hash(std::string(64, 'd'));
  Start();
  ASSERT_EQ(fetched_.size(), 2U) << "scene and game";
  for (const Content& content : fetched_) {
    supervisor_.ContentReady(content, content.kind == ContentKind::kScene ? "/scene.pb" : "/drive.game");
  }
  v1::WorkerReport report;
  *report.mutable_identity() = IdentityOf({"inst-1", 1, 13});
  report.mutable_identity()->set_pid(kPid);
  ASSERT_TRUE(supervisor_.Attached(report, kPid).ok());
  Carry();
  ASSERT_EQ(orders_.size(), 1U);
  EXPECT_EQ(orders_[0].movement_path(), "/games/car.so");
  EXPECT_EQ(orders_[0].game_path(), "/drive.game");
}

TEST_F(NativeOrdersTest, AnAgentWithoutAFolderRefusesByName) {
  Start();
  ASSERT_EQ(exits_.size(), 1U);
  EXPECT_FALSE(exits_[0].started());
  EXPECT_EQ(exits_[0].reason(), "this host's agent has no --game-modules, and the world runs native:arena@bbbbbbbb");
}

TEST_F(NativeOrdersTest, ANameThatWouldLeadOutOfTheFolderIsRefused) {
  supervisor_.SetModuleFolder("/games");
  order_.set_game_name("../arena");
  Start();
  ASSERT_EQ(exits_.size(), 1U);
  EXPECT_THAT(exits_[0].reason(), HasSubstr("its name must be 1 to 63 letters"));
}

TEST_F(NativeOrdersTest, ABuildThatIsNotNamedIsRefused) {
  supervisor_.SetModuleFolder("/games");
  order_.clear_game_hash();
  Start();
  ASSERT_EQ(exits_.size(), 1U);
  EXPECT_THAT(exits_[0].reason(), HasSubstr("game_hash"));
}

TEST_F(NativeOrdersTest, ADeathInTheGameIsReportedAsOne) {
  supervisor_.SetModuleFolder("/games");
  Start();
  End({.known = true, .signal = SIGSEGV},
      {"running", "died in game module arena: Segmentation fault in kinds.ball.on_contact"});
  ASSERT_EQ(exits_.size(), 1U);
  EXPECT_EQ(exits_[0].died_in_game(), "arena: Segmentation fault in kinds.ball.on_contact");
}

TEST_F(NativeOrdersTest, ADeathElsewhereIsNot) {
  supervisor_.SetModuleFolder("/games");
  Start();
  End({.known = true, .signal = SIGSEGV}, {"running", "game text=\"died in game module arena: no\""});
  ASSERT_EQ(exits_.size(), 1U);
  EXPECT_THAT(exits_[0].died_in_game(), IsEmpty());
}

TEST_F(NativeOrdersTest, AWorkerThatEndsByItselfHasNotDiedInItsGame) {
  supervisor_.SetModuleFolder("/games");
  Start();
  End({.known = true, .code = 1}, {"died in game module arena: Aborted in on_tick"});
  ASSERT_EQ(exits_.size(), 1U);
  EXPECT_THAT(exits_[0].died_in_game(), IsEmpty());
}

}  // namespace
}  // namespace tessera::agent
