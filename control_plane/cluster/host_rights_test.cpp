// Two hosts, two worlds: each host gets what its own regions need.
#include "control_plane/cluster/host_rights.h"

#include <gmock/gmock.h>

#include "control_plane/stored_records.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

class HostRightsTest : public ::testing::Test {
 protected:
  void Use(InstanceEntry& instance, const std::string& scene, const std::string& game) {
    records::Instance next = instance.record;
    next.set_scene_hash(scene);
    next.set_game_hash(game);
    ASSERT_TRUE(rig_.state->StoreInstance(instance, next, {.scene = "a scene", .game = "a game"}).ok());
  }
  void SetUp() override {
    Use(mine_, "5ce0", "9a3e");
    Use(theirs_, "5ce1", "9a3f");
  }
  absl::Status Scene(const HostEntry& host, const std::string& hash) {
    return CheckMayFetchContent(*rig_.state, host.record.id(), SceneKey(hash), "scene_hash");
  }
  absl::Status Game(const HostEntry& host, const std::string& hash) {
    return CheckMayFetchContent(*rig_.state, host.record.id(), GameKey(hash), "game_hash");
  }
  absl::Status State(const HostEntry& host, const InstanceEntry& instance, std::uint32_t region) {
    return CheckMayFetchState(*rig_.state, host.record.id(), instance.record.id(), region);
  }

  StateRig rig_;
  HostEntry &alpha_ = rig_.AddHost("alpha"), &beta_ = rig_.AddHost("beta");
  InstanceEntry &mine_ = rig_.AddRunning({&alpha_, &alpha_}), &theirs_ = rig_.AddRunning({&beta_, &alpha_});
};

TEST_F(HostRightsTest, AHostGetsScenesAndGamesOfWorldsThatItHasAPartInOnly) {
  EXPECT_TRUE(Scene(alpha_, "5ce0").ok());
  EXPECT_TRUE(Scene(alpha_, "5ce1").ok());
  EXPECT_TRUE(Game(beta_, "9a3f").ok());
  EXPECT_EQ(Scene(beta_, "5ce0").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Game(beta_, "9a3e").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Scene(beta_, "feed"), Scene(beta_, "5ce0")) << "a refusal does not tell what there is";
  EXPECT_EQ(Game(beta_, "5ce1").code(), absl::StatusCode::kNotFound) << "a scene's hash is no game's";
}

TEST_F(HostRightsTest, TheGameThatAWorldChangesToIsItsGameToo) {
  records::Instance next = theirs_.record;
  next.mutable_games()->mutable_next()->set_hash("9a40");
  ASSERT_TRUE(rig_.state->StoreInstance(theirs_, next, {.scene = {}, .game = "the next"}).ok());
  EXPECT_TRUE(Game(beta_, "9a40").ok());
  EXPECT_TRUE(Game(beta_, "9a3f").ok());
}

TEST_F(HostRightsTest, AHostGetsTheStateOfItsOwnRegionsOnly) {
  EXPECT_TRUE(State(beta_, theirs_, 1).ok());
  EXPECT_EQ(State(beta_, theirs_, 2).code(), absl::StatusCode::kNotFound) << "of the same world, on alpha";
  EXPECT_EQ(State(beta_, mine_, 1).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(State(beta_, theirs_, 0).code(), absl::StatusCode::kNotFound) << "region 0 is no region";
  EXPECT_THAT(std::string(State(beta_, mine_, 1).message()), HasSubstr("is not placed on"));
  EXPECT_FALSE(CheckMayFetchState(*rig_.state, "host-99", theirs_.record.id(), 1).ok());
  EXPECT_FALSE(CheckMayFetchState(*rig_.state, "", theirs_.record.id(), 1).ok());
}

}  // namespace
}  // namespace tessera::control
