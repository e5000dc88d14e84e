#include "control_plane/cluster/revocations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "control_plane/backup.h"
#include "control_plane/control_settings.h"
#include "control_plane/stored_records.h"
#include "control_plane/testing/state_rig.h"
#include "trust/revocation_list.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class RevocationsTest : public ::testing::Test {
 protected:
  RevocationsTest() { Load(); }

  void Load() {
    list_ = std::make_unique<Revocations>(*rig_.state, SystemRandomBytes);
    ASSERT_TRUE(list_->Load().ok());
  }
  absl::Status Ban(const std::string& player, const std::string& reason = "cheats") {
    Revoked next = list_->revoked();
    records::Ban& ban = next.bans[{"", player}];
    ban.set_player_id(player);
    ban.set_reason(reason);
    return list_->Change(next);
  }
  absl::Status Unban(const std::string& player) {
    Revoked next = list_->revoked();
    next.bans.erase({"", player});
    return list_->Change(next);
  }
  bool IsBanned(const std::string& player) const { return list_->revoked().bans.contains({"", player}); }
  std::string Stored() const { return rig_.store.Get(kRevocationsKey)->value; }
  // The store has this record from now on, and a control plane begins on it.
  void BeginWith(const std::string& record) {
    ASSERT_TRUE(rig_.store.Put(kRevocationsKey, record, rig_.store.Get(kRevocationsKey)->revision).ok());
    Load();
  }
  // As a restore from a backup makes it.
  static std::string Raised(const std::string& record) {
    records::Revocations raised;
    EXPECT_TRUE(raised.ParseFromString(record));
    Raise(raised);
    return raised.SerializeAsString();
  }

  StateRig rig_;
  std::unique_ptr<Revocations> list_;
};

TEST_F(RevocationsTest, EachChangeHasTheNextNumberAndIsSignedByAKeyThatStays) {
  EXPECT_EQ(list_->number(), 0u);
  ASSERT_TRUE(Ban("ada").ok());
  ASSERT_TRUE(Unban("ada").ok());
  EXPECT_EQ(list_->number(), 2u) << "what is lifted is a change as well";
  const std::string key = list_->public_key();
  Load();
  EXPECT_EQ(list_->public_key(), key);
  const auto verifies = trust::ReadRevocations(list_->newest(), *net::VerificationKeyFrom(key, "key"));
  ASSERT_TRUE(verifies.ok()) << verifies.status();
  EXPECT_EQ(verifies->number(), 2u);
}

TEST_F(RevocationsTest, ATokenIsNamedUntilItWouldHaveRunOutAndHostsDoNotSeeWhichItWas) {
  records::AccessToken token, forever;
  token.set_secret_hash("hash of ada's secret");
  *token.mutable_expire_time() = ToTimestamp(rig_.now.unix_time + std::chrono::hours(1));
  forever.set_secret_hash("hash of bob's secret");
  ASSERT_TRUE(list_->AddToken(token, rig_.now).ok());
  ASSERT_TRUE(list_->AddIssuer("a public key").ok());
  EXPECT_TRUE(list_->revoked().tokens.contains(token.secret_hash()));
  EXPECT_THAT(list_->newest().list(), Not(HasSubstr("hash of")));
  EXPECT_THAT(list_->newest().list(), Not(HasSubstr("public key")));
  Load();
  EXPECT_TRUE(list_->revoked().tokens.contains(token.secret_hash())) << "it is stored";
  Now later = rig_.now;
  later.unix_time += std::chrono::hours(1);
  ASSERT_TRUE(list_->AddToken(forever, later).ok());
  EXPECT_FALSE(list_->revoked().tokens.contains(token.secret_hash()));
  EXPECT_TRUE(list_->revoked().tokens.contains(forever.secret_hash()));
  ASSERT_TRUE(list_->LiftIssuer("a public key").ok());
  EXPECT_TRUE(list_->revoked().issuers.empty());
}

TEST_F(RevocationsTest, ThereIsAMostOfTokens) {
  Revoked full;
  for (std::size_t i = 0; i < kMaxRevokedTokens; ++i) {
    full.tokens[absl::StrCat("hash ", i)].set_secret_hash(absl::StrCat("hash ", i));
  }
  ASSERT_TRUE(list_->Change(full).ok());
  records::AccessToken token;
  token.set_secret_hash("one more");
  EXPECT_EQ(list_->AddToken(token, rig_.now).code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(RevocationsTest, AHostIsNamedWithTheLivesThatItRunsUntilTheirWorldHasEnded) {
  HostEntry& alpha = rig_.AddHost("alpha");
  HostEntry& beta = rig_.AddHost("beta");
  InstanceEntry& world = rig_.AddRunning({&alpha, &beta});
  ASSERT_TRUE(list_->AddHost(beta).ok());
  ASSERT_TRUE(list_->AddHost(beta).ok());
  EXPECT_EQ(list_->number(), 1u) << "the second time changed nothing";
  EXPECT_TRUE(list_->revoked().hosts.contains(beta.number));
  const Revoked::Life life{world.record.id(), 2, StateRig::WorkerOf(world, 2).incarnation};
  EXPECT_EQ(list_->revoked().workers, std::set<Revoked::Life>{life});
  Load();
  EXPECT_EQ(list_->revoked().workers, std::set<Revoked::Life>{life});
  records::Instance ended = world.record;
  ended.set_state(v1::INSTANCE_STATE_ENDED);
  ASSERT_TRUE(rig_.state->StoreInstance(world, ended).ok());
  ASSERT_TRUE(Ban("ada").ok());
  EXPECT_TRUE(list_->revoked().workers.empty());
  EXPECT_TRUE(list_->revoked().hosts.contains(beta.number)) << "an old backup still has it";
}

TEST_F(RevocationsTest, HostsAreNotShownWhoIsBanned) {
  ASSERT_TRUE(Ban("ada-lovelace", "shouts").ok());
  EXPECT_THAT(list_->newest().list(), Not(HasSubstr("lovelace")));
  EXPECT_THAT(list_->newest().list(), Not(HasSubstr("shouts")));
}

TEST_F(RevocationsTest, AFullListAndAStoreThatTakesNothingChangeNothing) {
  ASSERT_TRUE(Ban("ada").ok());
  const absl::Status full = Ban("bob", std::string(trust::kMaxRevocationBytes, 'x'));
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(full.message()), HasSubstr("lift bans"));
  rig_.store.FailNext(1);
  EXPECT_EQ(Ban("bob").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(list_->number(), 1u);
  EXPECT_FALSE(IsBanned("bob"));
  EXPECT_TRUE(Ban("bob").ok());
}

TEST_F(RevocationsTest, ANewerListTakesThePlaceOfAnOlderStoresAndAnOlderOneDoesNot) {
  ASSERT_TRUE(Ban("ada").ok());
  const std::string old_store = Stored();
  const v1::SignedRevocations old_list = list_->newest();
  ASSERT_TRUE(Unban("ada").ok());
  ASSERT_TRUE(Ban("bob").ok());
  const v1::SignedRevocations newest = list_->newest();
  EXPECT_FALSE(list_->Lacks(1));
  EXPECT_EQ(*list_->TakeUp(old_list), false);
  EXPECT_TRUE(IsBanned("bob"));

  BeginWith(old_store);
  ASSERT_TRUE(IsBanned("ada"));
  ASSERT_TRUE(list_->Lacks(3));
  ASSERT_EQ(*list_->TakeUp(newest), true);
  EXPECT_TRUE(IsBanned("bob"));
  EXPECT_FALSE(IsBanned("ada")) << "the ban was lifted";
  EXPECT_EQ(list_->number(), 4u) << "so every host takes it, also the one that it came from";
}

TEST_F(RevocationsTest, AListOfTheTimeThatARestoreLostIsAddedToWhatWasDecidedSince) {
  HostEntry& beta = rig_.AddHost("beta");
  const std::string backup = Stored();
  ASSERT_TRUE(Ban("bob").ok());
  ASSERT_TRUE(list_->AddHost(beta).ok());
  const v1::SignedRevocations lost = list_->newest();

  BeginWith(Raised(backup));
  EXPECT_EQ(list_->number(), kRestoreJump);
  ASSERT_TRUE(Ban("eve").ok());
  ASSERT_TRUE(list_->Lacks(2));
  ASSERT_EQ(*list_->TakeUp(lost), true);
  EXPECT_TRUE(IsBanned("bob"));
  EXPECT_TRUE(IsBanned("eve"));
  EXPECT_TRUE(list_->revoked().hosts.contains(beta.number));
  EXPECT_EQ(list_->number(), kRestoreJump + 2);
  EXPECT_FALSE(list_->Lacks(1)) << "a list before the one that was taken up";
  EXPECT_EQ(*list_->TakeUp(lost), false);
}

TEST_F(RevocationsTest, AListOfAnotherKeyIsRefusedHoweverHighItsNumber) {
  v1::Revocations content;
  content.set_number(1'000);
  content.add_hosts()->set_first(1);
  const auto forged = trust::SignRevocations(content, net::SigningKey::Make());
  EXPECT_EQ(list_->TakeUp(*forged).status().code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(list_->number(), 0u);
}

TEST_F(RevocationsTest, BansOfAStoreOfBeforeTheListAreTakenOver) {
  ASSERT_TRUE(rig_.store.Delete(kRevocationsKey, rig_.store.Get(kRevocationsKey)->revision).ok());
  records::Ban ban;
  ban.set_player_id("ada");
  ban.set_reason("cheats");
  ASSERT_TRUE(rig_.store.Put("ban/0011", ban.SerializeAsString(), kAbsent).ok());
  Load();
  EXPECT_TRUE(IsBanned("ada"));
  EXPECT_EQ(list_->number(), 1u);
  EXPECT_TRUE(rig_.store.List("ban/")->empty());
}

}  // namespace
}  // namespace tessera::control
