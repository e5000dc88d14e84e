#include "control_plane/cluster/bans.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

class BansTest : public ::testing::Test {
 protected:
  BansTest() { EXPECT_TRUE(revocations_.Load().ok()); }

  StateRig rig_;
  Revocations revocations_{*rig_.state, SystemRandomBytes};
  Bans bans_{revocations_};
};

TEST_F(BansTest, OneOfAnInstanceHoldsThereAndOneOfTheClusterEverywhere) {
  ASSERT_TRUE(bans_.Add("inst-1", "ada", "cheats", rig_.now).ok());
  ASSERT_TRUE(bans_.Add("", "bob", "shouts", rig_.now).ok());
  EXPECT_EQ(bans_.Check("inst-1", "ada"), absl::PermissionDeniedError("player: is banned: cheats"));
  EXPECT_TRUE(bans_.Check("inst-2", "ada").ok());
  EXPECT_EQ(bans_.Check("inst-2", "bob"), absl::PermissionDeniedError("player: is banned: shouts"));
  EXPECT_TRUE(bans_.Check("inst-1", "eve").ok());
  EXPECT_EQ(bans_.List("inst-1").bans_size(), 1);
  EXPECT_EQ(bans_.List("").bans(0).player_id(), "bob");
}

TEST_F(BansTest, TheNextLifeKnowsThemAndWhoIsUnbannedIsLetIn) {
  ASSERT_TRUE(bans_.Add("inst-1", "ada", "cheats", rig_.now).ok());
  ASSERT_TRUE(bans_.Add("inst-1", "ada", "cheats again", rig_.now).ok()) << "a new reason";
  Revocations loaded{*rig_.state, SystemRandomBytes};
  ASSERT_TRUE(loaded.Load().ok());
  Bans next{loaded};
  EXPECT_EQ(next.Check("inst-1", "ada"), absl::PermissionDeniedError("player: is banned: cheats again"));
  v1::UnbanPlayerRequest unban;
  unban.set_id("inst-1");
  unban.set_player_id("ada");
  rig_.store.FailNext(1);
  EXPECT_EQ(next.Remove(unban).code(), absl::StatusCode::kUnavailable);
  EXPECT_FALSE(next.Check("inst-1", "ada").ok());
  EXPECT_TRUE(next.Remove(unban).ok());
  EXPECT_TRUE(next.Check("inst-1", "ada").ok());
  EXPECT_EQ(next.Remove(unban).code(), absl::StatusCode::kNotFound);
}

TEST_F(BansTest, ThoseOfAnInstanceGoWithIt) {
  ASSERT_TRUE(bans_.Add("inst-1", "ada", "x", rig_.now).ok());
  ASSERT_TRUE(bans_.Add("inst-12", "ada", "x", rig_.now).ok());
  bans_.ForgetInstance("inst-1");
  EXPECT_EQ(bans_.List("inst-1").bans_size(), 0);
  EXPECT_EQ(bans_.List("inst-12").bans_size(), 1);
  Revocations loaded{*rig_.state, SystemRandomBytes};
  ASSERT_TRUE(loaded.Load().ok());
  Bans next{loaded};
  EXPECT_EQ(next.List("inst-1").bans_size(), 0);
}

TEST_F(BansTest, BadFieldsAreNamed) {
  const auto why_not = [&](const std::string& player, const std::string& reason) {
    return std::string(bans_.Add("inst-1", player, reason, rig_.now).status().message());
  };
  EXPECT_THAT(why_not("", "x"), HasSubstr("player_id: 0 bytes are not 1 to 64"));
  EXPECT_THAT(why_not(std::string(65, 'x'), "x"), HasSubstr("player_id: "));
  EXPECT_THAT(why_not("a\nb", "x"), HasSubstr("player_id: "));
  EXPECT_THAT(why_not("ada", std::string(201, 'x')), HasSubstr("reason: 201 bytes"));
  EXPECT_THAT(why_not("ada", "\xff"), HasSubstr("reason: "));
}

}  // namespace
}  // namespace tessera::control
