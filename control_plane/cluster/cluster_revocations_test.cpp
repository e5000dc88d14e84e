// The list of revocations between a cluster and its agents, under a virtual clock: who keeps it, and that no old backup
// undoes what it says.
#include <gmock/gmock.h>

#include <chrono>
#include <map>
#include <string>

#include "control_plane/cluster/hosts.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/stored_records.h"
#include "control_plane/testing/cluster_harness.h"
#include "control_plane/testing/fake_backend.h"
#include "net/signing_key.h"
#include "trust/revocation_list.h"
#include "trust/ticket.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;

absl::Status EvictForGood(ClusterHarness& harness, const std::string& name) {
  v1::RemoveHostRequest request;
  request.set_name(name);
  request.set_force(true);
  return harness.cluster().RemoveHost(harness.now, request);
}

void BanEverywhere(ClusterHarness& harness, const std::string& player_id) {
  v1::BanPlayerRequest request;
  request.set_player_id(player_id);
  request.set_reason("cheats");
  ASSERT_TRUE(harness.cluster().BanPlayer(harness.now, request).ok());
}

std::size_t BansOf(ClusterHarness& harness) {
  return static_cast<std::size_t>(harness.cluster().ListBans({})->bans_size());
}

class ClusterRevocationsTest : public ::testing::Test {
 protected:
  ClusterRevocationsTest() {
    harness_.AddHost("alpha", 16);
    harness_.AddHost("beta", 16);
  }
  // Whether a worker of the agent that asks for a lease gets one.
  bool GetsLease(FakeHost& agent) {
    harness_.cluster().TakeEffects();
    v1::AgentMessage message;
    *message.mutable_lease()->mutable_identity() = agent.fake.workers.begin()->second.report.identity();
    message.mutable_lease()->set_number(1);
    harness_.Send(agent, message);
    return !harness_.cluster().TakeEffects().leases.empty();
  }

  // The secret of a new token.
  std::string MakeToken(const std::string& name) {
    v1::CreateTokenRequest request;
    request.set_name(name);
    request.set_role(v1::ROLE_OPERATOR);
    return harness_.cluster().CreateToken(harness_.now, request)->secret();
  }
  absl::Status RevokeToken(const std::string& name) {
    v1::RevokeTokenRequest request;
    request.set_name(name);
    return harness_.cluster().RevokeToken(harness_.now, request);
  }
  bool Proves(const std::string& secret) { return harness_.cluster().tokens().Find(secret, harness_.now) != nullptr; }
  absl::Status RemoveIssuer(const std::string& name) {
    v1::RemoveIssuerRequest request;
    request.set_name(name);
    return harness_.cluster().RemoveIssuer(request);
  }
  bool IsIssuer(const FakeBackend& backend) {
    return harness_.cluster().issuers().Find(trust::KeyIdOf(trust::PublicKeyOf(backend.seed))) != nullptr;
  }

  ClusterHarness harness_;
};

TEST_F(ClusterRevocationsTest, EveryAgentKeepsTheNewestList) {
  harness_.Run(seconds(1));
  EXPECT_EQ(ClusterHarness::KeptBy(harness_.agents.at("alpha")), 0u) << "there is none yet";
  BanEverywhere(harness_, "ada");
  BanEverywhere(harness_, "bob");
  harness_.Run(seconds(1));
  EXPECT_EQ(ClusterHarness::KeptBy(harness_.agents.at("alpha")), 2u);
  EXPECT_EQ(ClusterHarness::KeptBy(harness_.agents.at("beta")), 2u);
  EXPECT_FALSE(harness_.Exchange()) << "who keeps it is not sent it again";
}

TEST_F(ClusterRevocationsTest, AWorkerWhoseAgentDoesNotKeepTheNewestListGetsNoLease) {
  Start(harness_, 4);
  FakeHost& alpha = harness_.agents.at("alpha");
  ASSERT_FALSE(alpha.fake.workers.empty());
  EXPECT_TRUE(GetsLease(alpha));
  alpha.keeps_revocations = false;
  BanEverywhere(harness_, "ada");
  EXPECT_FALSE(GetsLease(alpha)) << "not even before the list can have come";
  harness_.Run(seconds(1));
  EXPECT_FALSE(GetsLease(alpha));
  ASSERT_FALSE(harness_.agents.at("beta").fake.workers.empty());
  EXPECT_TRUE(GetsLease(harness_.agents.at("beta")));
  harness_.Restart();
  harness_.Run(seconds(1));
  EXPECT_FALSE(GetsLease(alpha)) << "the next control plane asks for the same";
  alpha.keeps_revocations = true;
  harness_.Restart();
  harness_.Run(seconds(1));
  EXPECT_TRUE(GetsLease(alpha));
}

TEST_F(ClusterRevocationsTest, ARestoredOldBackupDoesNotUndoAnEviction) {
  const std::string id = Start(harness_, 4);
  const std::string backup = harness_.Backup();
  FakeHost& beta = harness_.agents.at("beta");
  beta.silent = true;
  ASSERT_TRUE(EvictForGood(harness_, "beta").ok());
  harness_.Run(seconds(20));
  ASSERT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness_.Get(id).reason();

  harness_.BeginFrom(backup);
  ASSERT_NE(FindHostByName(harness_.cluster().state(), "beta"), nullptr) << "the backup knows it as one of its own";
  beta.silent = false;  // and it comes back with what it had
  harness_.Run(seconds(5));
  EXPECT_EQ(FindHostByName(harness_.cluster().state(), "beta"), nullptr);
  v1::AgentHello hello = ClusterHarness::Hello(16);
  hello.set_host_id(beta.host_id);
  hello.set_host_secret(beta.secret);
  EXPECT_EQ(harness_.cluster().HandleHello(harness_.now, hello).status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_FALSE(harness_.cluster().state().recovering());
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness_.Get(id).reason();
  EXPECT_EQ(harness_.agents.at("alpha").fake.workers.size(), 4u);
  harness_.Restart();
  EXPECT_EQ(FindHostByName(harness_.cluster().state(), "beta"), nullptr) << "it is stored";
}

TEST_F(ClusterRevocationsTest, ARestoredOldBackupDoesNotUndoABanNorItsLifting) {
  BanEverywhere(harness_, "ada");
  const std::string backup = harness_.Backup();
  v1::UnbanPlayerRequest unban;
  unban.set_player_id("ada");
  ASSERT_TRUE(harness_.cluster().UnbanPlayer(unban).ok());
  BanEverywhere(harness_, "bob");
  harness_.Run(seconds(1));
  harness_.BeginFrom(backup);
  ASSERT_EQ(harness_.cluster().ListBans({})->bans(0).player_id(), "ada");
  harness_.Run(seconds(2));
  ASSERT_EQ(BansOf(harness_), 1u);
  EXPECT_EQ(harness_.cluster().ListBans({})->bans(0).player_id(), "bob");
  EXPECT_EQ(harness_.cluster().ListBans({})->bans(0).reason(), "cheats");
}

TEST_F(ClusterRevocationsTest, WhoIsBannedByAListThatComesLateIsSentAway) {
  const std::string id = Start(harness_, 2);
  trust::Ticket ticket;
  ticket.player_id = "bob";
  ticket.name = "Bob";
  v1::JoinInstanceRequest request;
  request.set_instance_id(id);
  ASSERT_TRUE(harness_.cluster().Join(harness_.now, request, ticket).ok());
  harness_.Run(seconds(1));
  const std::string backup = harness_.Backup();
  FakeHost& alpha = harness_.agents.at("alpha");
  BanEverywhere(harness_, "bob");
  harness_.Run(seconds(1));
  const v1::SignedRevocations lost = alpha.revocations;

  // Nobody of those that answer at first has the list; then one brings it.
  alpha.revocations = harness_.agents.at("beta").revocations = {};
  harness_.BeginFrom(backup);
  harness_.Run(seconds(2));
  ASSERT_FALSE(harness_.cluster().state().recovering());
  BanEverywhere(harness_, "eve");
  ASSERT_EQ(BansOf(harness_), 1u);
  alpha.revocations = lost;
  alpha.stream = 0;
  harness_.Run(seconds(2));
  EXPECT_EQ(BansOf(harness_), 2u);
  const auto& players = harness_.cluster().state().FindInstance(id)->players;
  ASSERT_EQ(players.size(), 1U);
  EXPECT_TRUE(players.All()[0]->player().left());
  EXPECT_EQ(players.All()[0]->player().ended_because(), "cheats");
  EXPECT_EQ(ClusterHarness::KeptBy(alpha), ClusterHarness::KeptBy(harness_.agents.at("beta")));
}

TEST_F(ClusterRevocationsTest, ARestoredOldBackupBringsBackNeitherARevokedTokenNorARemovedIssuer) {
  const FakeBackend game{1}, other{2};
  const std::string ada = MakeToken("ada"), bob = MakeToken("bob");
  ASSERT_TRUE(harness_.cluster().AddIssuer(harness_.now, game.Registration("game")).ok());
  ASSERT_TRUE(harness_.cluster().AddIssuer(harness_.now, other.Registration("other")).ok());
  const std::string backup = harness_.Backup();
  ASSERT_TRUE(RevokeToken("ada").ok());
  ASSERT_TRUE(RemoveIssuer("game").ok());
  ASSERT_FALSE(Proves(ada) || IsIssuer(game));
  harness_.Run(seconds(1));

  harness_.BeginFrom(backup);
  ASSERT_TRUE(Proves(ada) && IsIssuer(game)) << "the backup knows them";
  harness_.Run(seconds(2));
  EXPECT_FALSE(Proves(ada));
  EXPECT_FALSE(IsIssuer(game));
  EXPECT_TRUE(Proves(bob) && IsIssuer(other)) << "nobody has revoked these";
  harness_.Restart();
  EXPECT_FALSE(Proves(ada) || IsIssuer(game)) << "it is stored";

  ASSERT_TRUE(harness_.cluster().AddIssuer(harness_.now, game.Registration("game")).ok()) << "on purpose";
  harness_.Run(seconds(1));
  harness_.Restart();
  EXPECT_TRUE(IsIssuer(game));
}

TEST_F(ClusterRevocationsTest, ATokenThatTheStoreDroppedHalfProvesNothingInTheNextLife) {
  const std::string ada = MakeToken("ada");
  const std::string record = harness_.store.Get("token/ada")->value;
  ASSERT_TRUE(RevokeToken("ada").ok());
  ASSERT_TRUE(harness_.store.Put("token/ada", record, kAbsent).ok());  // as if it had died between its two writes
  harness_.Restart();
  EXPECT_FALSE(Proves(ada)) << "from the first moment on";
  EXPECT_EQ(harness_.cluster().tokens().List().tokens_size(), 0);
  EXPECT_EQ(RevokeToken("ada").code(), absl::StatusCode::kNotFound);
}

TEST_F(ClusterRevocationsTest, TheSummaryNamesWhoAnswersAndDoesNotKeepTheNewestList) {
  const auto behind = [&] {
    return Summarise(harness_.cluster().state(), harness_.cluster().revocations().number()).behind_revocations;
  };
  using Behind = std::map<std::string, bool>;
  EXPECT_EQ(behind(), (Behind{{"alpha", false}, {"beta", false}})) << "there is no list yet";
  harness_.agents.at("beta").keeps_revocations = false;
  BanEverywhere(harness_, "ada");
  EXPECT_EQ(behind(), (Behind{{"alpha", true}, {"beta", true}})) << "it is on its way";
  harness_.Run(seconds(1));
  EXPECT_EQ(behind(), (Behind{{"alpha", false}, {"beta", true}}));
  harness_.cluster().HandleAgentGone(harness_.agents.at("beta").stream);
  EXPECT_EQ(behind(), (Behind{{"alpha", false}})) << "whoever is away runs nothing by a lease of ours";
}

TEST_F(ClusterRevocationsTest, AListThatTheClusterDidNotSignChangesNothing) {
  v1::Revocations content;
  content.set_number(1'000);
  v1::RevokedHosts& run = *content.add_hosts();
  run.set_first(1);
  run.set_last(2);
  FakeHost& alpha = harness_.agents.at("alpha");
  alpha.revocations = *trust::SignRevocations(content, net::SigningKey::Make());
  alpha.stream = 0;
  harness_.Run(seconds(1));
  EXPECT_NE(FindHostByName(harness_.cluster().state(), "alpha"), nullptr);
  EXPECT_NE(FindHostByName(harness_.cluster().state(), "beta"), nullptr);
  EXPECT_NE(alpha.stream, 0u) << "nor is the host sent away for it";
}

TEST_F(ClusterRevocationsTest, AnEvictionThatTheStoreTookHalfIsCarriedOut) {
  const std::string key = HostKey(FindHostByName(harness_.cluster().state(), "beta")->number);
  const std::string record = harness_.store.Get(key)->value;
  ASSERT_TRUE(EvictForGood(harness_, "beta").ok());
  ASSERT_TRUE(harness_.store.Put(key, record, kAbsent).ok());  // as if it had died between its two writes
  harness_.Restart();
  ASSERT_NE(FindHostByName(harness_.cluster().state(), "beta"), nullptr);
  harness_.Run(seconds(1));
  EXPECT_EQ(FindHostByName(harness_.cluster().state(), "beta"), nullptr);
}

TEST_F(ClusterRevocationsTest, ATooLargeListIsRefusedByName) {
  v1::AgentMessage message;
  message.mutable_revocations()->set_list(std::string(2 << 20, 'x'));
  EXPECT_THAT(
      std::string(
          harness_.cluster().HandleAgentMessage(harness_.now, harness_.agents.at("alpha").stream, message).message()),
      HasSubstr("revocations: has 2097"));
}

}  // namespace
}  // namespace tessera::control
