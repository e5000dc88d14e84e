#include "control_plane/etcd/etcd_election.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>

#include "control_plane/testing/fake_etcd.h"
#include "control_plane/testing/loopback_door.h"
#include "control_plane/testing/real_etcd.h"

namespace tessera::control {
namespace {

using namespace std::chrono_literals;

constexpr ElectionTimes kQuick{.ttl = 2s, .poll = 10ms};
constexpr std::chrono::milliseconds kProofPatience{10'000};  // far beyond what a read takes
const auto kNobodyGivesUp = [] { return false; };
const auto kNobodyListens = [](const std::optional<LeaderAddress>&) {};

class EtcdElectionTest : public ::testing::Test {
 protected:
  FakeEtcd etcd_;
  std::unique_ptr<EtcdClient> client_ = etcd_.Connect();
};

TEST_F(EtcdElectionTest, TheFirstLeadsAndSaysWhere) {
  EtcdElection one(*client_, "tessera", {.operators = "10.0.0.1:7700", .players = ""}, kQuick);
  EXPECT_LE(one.Left(), 0s);
  const auto fence = one.Campaign(kNobodyListens, kNobodyGivesUp);
  ASSERT_TRUE(fence.ok()) << fence.status();
  EXPECT_EQ(fence->key, "tessera/leader");
  EXPECT_GT(fence->token, 0);
  EXPECT_EQ(etcd_.Value("tessera/leader"), "10.0.0.1:7700 -");
  EXPECT_GT(one.Left(), 0s);
  EXPECT_LE(one.Left(), 1800ms) << "a tenth is kept back";
}

TEST_F(EtcdElectionTest, AFollowerLearnsWhoLeadsAndIsNext) {
  EtcdElection one(*client_, "tessera", {.operators = "10.0.0.1:7700", .players = "10.0.0.1:7703"}, kQuick);
  EtcdElection two(*client_, "tessera", {.operators = "10.0.0.2:7700", .players = ""}, kQuick);
  const auto first = one.Campaign(kNobodyListens, kNobodyGivesUp);
  std::optional<LeaderAddress> followed;
  const auto follow = [&](const std::optional<LeaderAddress>& leader) {
    if (leader) {
      followed = leader;
      one.Resign();
    }
  };
  const auto second = two.Campaign(follow, kNobodyGivesUp);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(followed, (LeaderAddress{.operators = "10.0.0.1:7700", .players = "10.0.0.1:7703"}));
  EXPECT_GT(second->token, first->token);
  EXPECT_LE(one.Left(), 0s);
  EXPECT_EQ(etcd_.Value("tessera/leader"), "10.0.0.2:7700 -");
}

TEST_F(EtcdElectionTest, ACampaignIsGivenUp) {
  EtcdElection one(*client_, "tessera", {}, kQuick), two(*client_, "tessera", {}, kQuick);
  ASSERT_TRUE(one.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  int asked = 0;
  EXPECT_EQ(two.Campaign(kNobodyListens, [&] { return ++asked > 3; }).status().code(), absl::StatusCode::kCancelled);
  EXPECT_GT(one.Left(), 0s);
}

TEST_F(EtcdElectionTest, AnUnansweredCampaignThatWonIsFound) {
  etcd_.FailNext({FakeEtcd::Fault::kLoseAnswer});
  EtcdElection one(*client_, "tessera", {.operators = "a:1", .players = ""}, kQuick);
  const auto fence = one.Campaign(kNobodyListens, kNobodyGivesUp);
  ASSERT_TRUE(fence.ok()) << fence.status();
  EXPECT_EQ(etcd_.Value("tessera/leader"), "a:1 -");
  EXPECT_EQ(etcd_.transactions(), 2);
}

TEST_F(EtcdElectionTest, AnExpiredLeaseEndsIt) {
  EtcdElection one(*client_, "tessera", {}, kQuick);
  ASSERT_TRUE(one.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  etcd_.ExpireLeases();
  one.WaitUntilLost(kNobodyGivesUp);
  EXPECT_LE(one.Left(), 0s);
}

// etcd 3.4.23 has said yes to the renewal of a lease that it had revoked.
TEST_F(EtcdElectionTest, ARenewalWithoutTheKeyEndsIt) {
  EtcdElection one(*client_, "tessera", {}, kQuick);
  ASSERT_TRUE(one.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  etcd_.ForgetKeys();
  one.WaitUntilLost(kNobodyGivesUp);
  EXPECT_LE(one.Left(), 0s);
}

TEST_F(EtcdElectionTest, WithoutRenewalsItEndsBeforeTheLeaseDoes) {
  EtcdElection one(*client_, "tessera", {}, kQuick);
  const auto begun = EtcdElection::Clock::now();
  ASSERT_TRUE(one.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  etcd_.FailRenewals(true);
  one.WaitUntilLost(kNobodyGivesUp);
  EXPECT_LE(one.Left(), 0s);
  EXPECT_GE(EtcdElection::Clock::now() - begun, 1700ms);
  EXPECT_FALSE(etcd_.Value("tessera/leader").empty()) << "etcd still holds the key, and nobody else can lead yet";
}

// As a leader that was cut off does when it is back.
TEST_F(EtcdElectionTest, ALeaseThatCouldNotBeEndedIsEndedLater) {
  EtcdElection one(*client_, "tessera", {.operators = "a:1", .players = ""}, kQuick);
  EtcdElection two(*client_, "tessera", {.operators = "b:1", .players = ""}, kQuick);
  ASSERT_TRUE(one.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  etcd_.FailRevocations(true);
  one.Resign();
  EXPECT_EQ(etcd_.Value("tessera/leader"), "a:1 -");
  int asked = 0;
  EXPECT_FALSE(one.Campaign(kNobodyListens, [&] { return ++asked > 3; }).ok()) << "nor can we lead again by that lease";
  EXPECT_EQ(etcd_.Value("tessera/leader"), "a:1 -");

  etcd_.FailRevocations(false);
  asked = 0;
  (void)one.Campaign(kNobodyListens, [&] { return ++asked > 1 || etcd_.Value("tessera/leader").empty(); });
  EXPECT_EQ(etcd_.Value("tessera/leader"), "") << "the fake's leases have no time of their own: nothing else ends it";
  EXPECT_TRUE(two.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  EXPECT_EQ(etcd_.Value("tessera/leader"), "b:1 -");
}

TEST_F(EtcdElectionTest, WhoLeadsProvesItUntilTheKeyIsGone) {
  EtcdElection one(*client_, "tessera", {}, kQuick);
  ASSERT_TRUE(one.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  EXPECT_TRUE(one.Confirm(kProofPatience));
  etcd_.ForgetKeys();
  EXPECT_FALSE(one.Confirm(kProofPatience)) << "etcd goes on renewing the lease";
  EXPECT_LE(one.Left(), 0s) << "and it knows now";
}

TEST_F(EtcdElectionTest, TheKeyOfAnotherLeaderProvesNothing) {
  EtcdElection one(*client_, "tessera", {}, kQuick), two(*client_, "tessera", {}, kQuick);
  ASSERT_TRUE(one.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  etcd_.ExpireLeases();
  ASSERT_TRUE(two.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  EXPECT_FALSE(one.Confirm(kProofPatience));
  EXPECT_LE(one.Left(), 0s);
  EXPECT_TRUE(two.Confirm(kProofPatience));
}

TEST_F(EtcdElectionTest, AReadWithoutAnAnswerProvesNothingAndTheLeaseStands) {
  EtcdElection one(*client_, "tessera", {}, {.ttl = 30s, .poll = 10ms});
  ASSERT_TRUE(one.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  etcd_.FailReads(true);
  EXPECT_FALSE(one.Confirm(100ms));
  EXPECT_GT(one.Left(), 0s);
  etcd_.FailReads(false);
  EXPECT_TRUE(one.Confirm(kProofPatience));
}

TEST_F(EtcdElectionTest, RenewalsKeepIt) {
  EtcdElection one(*client_, "tessera", {}, kQuick);
  ASSERT_TRUE(one.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  const auto until = EtcdElection::Clock::now() + 3s;
  one.WaitUntilLost([&] { return EtcdElection::Clock::now() >= until; });
  EXPECT_GT(one.Left(), 0s);
}

// A leader whose process is killed while its lease stands: the fake's have no time of their own.
class EtcdElectionDeathTest : public EtcdElectionTest {
 protected:
  EtcdElectionDeathTest() {
    const auto fence = leader_.Campaign(kNobodyListens, kNobodyGivesUp);
    EXPECT_TRUE(fence.ok()) << fence.status();
    token_ = fence->token;
  }
  // Another one campaigns, for so many polls unless it is elected. Before each of them `before` is called.
  bool IsElected(int polls, const std::function<void()>& before) {
    EtcdElection next(*client_, "tessera", {.operators = "10.0.0.2:7700", .players = ""}, kQuick);
    const auto fence = next.Campaign(kNobodyListens, [&] {
      before();
      return --polls < 0;
    });
    EXPECT_TRUE(!fence.ok() || fence->token > token_);
    return fence.ok();
  }

  LoopbackDoor door_;
  EtcdElection leader_{*client_, "tessera", {.operators = door_.address(), .players = ""}, kQuick};
  std::int64_t token_ = 0;
};

TEST_F(EtcdElectionDeathTest, ATermEndsWithTheProcess) {
  leader_.SetServing(true);
  EXPECT_EQ(etcd_.Value("tessera/serving"), std::to_string(token_));
  EXPECT_TRUE(IsElected(10'000, [&] {
    if (door_.Accept() > 0) door_.Close();
  }));
  EXPECT_FALSE(leader_.Confirm(kProofPatience)) << "were it alive after all, it would know";
}

TEST_F(EtcdElectionDeathTest, ByThePlayersDoorWhereItHasNoOther) {
  leader_.Resign();
  EtcdElection other(*client_, "tessera", {.operators = "", .players = door_.address()}, kQuick);
  ASSERT_TRUE(other.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  other.SetServing(true);
  EXPECT_TRUE(IsElected(10'000, [&] {
    if (door_.Accept() > 0) door_.Close();
  }));
}

// Its doors are closed while it reads the cluster's state.
TEST_F(EtcdElectionDeathTest, WhoDoesNotServeYetIsNotLookedAt) {
  int reached = 0;
  EXPECT_FALSE(IsElected(20, [&] { reached += door_.Accept(); }));
  EXPECT_EQ(reached, 0);
  EXPECT_TRUE(leader_.Confirm(kProofPatience));
}

TEST_F(EtcdElectionDeathTest, WhoClosesItsDoorsInGoodOrderIsNotGone) {
  leader_.SetServing(true);
  EXPECT_FALSE(IsElected(20, [&] {
    if (door_.Accept() == 0) return;
    leader_.SetServing(false);
    door_.Close();
  }));
  EXPECT_EQ(etcd_.Value("tessera/serving"), "");
  EXPECT_TRUE(leader_.Confirm(kProofPatience));
}

TEST_F(EtcdElectionDeathTest, WhatALeaderBeforeItSaidIsNotItsOwn) {
  etcd_.Put("tessera/serving", std::to_string(token_ - 1));
  int reached = 0;
  EXPECT_FALSE(IsElected(20, [&] { reached += door_.Accept(); }));
  EXPECT_EQ(reached, 0);
}

TEST_F(EtcdElectionDeathTest, WhoIsDeposedSaysNothing) {
  etcd_.ForgetKeys();
  leader_.SetServing(true);
  EXPECT_EQ(etcd_.Value("tessera/serving"), "");
}

// A leader that is cut off or stands still: its lease stands, and hardly anything is left of it.
class EtcdElectionSilenceTest : public EtcdElectionTest {
 protected:
  // Another one campaigns, for so many polls unless it is elected.
  bool IsElected(std::chrono::seconds ttl, int polls) {
    EtcdElection next(*client_, "tessera", {.operators = "b:1", .players = ""}, {.ttl = ttl, .poll = 10ms});
    return next.Campaign(kNobodyListens, [&] { return --polls < 0; }).ok();
  }
};

TEST_F(EtcdElectionSilenceTest, WhoDoesNotRenewIsNotWaitedForToTheEnd) {
  EtcdElection leader(*client_, "tessera", {.operators = "a:1", .players = ""}, {.ttl = 4s, .poll = 10ms});
  ASSERT_TRUE(leader.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  etcd_.SetLeft(0s);  // less than one
  EXPECT_TRUE(IsElected(4s, 10'000));
  EXPECT_FALSE(leader.Confirm(kProofPatience)) << "were it alive after all, it would know";
  EXPECT_LE(leader.Left(), 0s);
}

TEST_F(EtcdElectionSilenceTest, WhoHasMoreLeftIsLetBe) {
  EtcdElection leader(*client_, "tessera", {.operators = "a:1", .players = ""}, {.ttl = 4s, .poll = 10ms});
  ASSERT_TRUE(leader.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  etcd_.SetLeft(1s);
  EXPECT_FALSE(IsElected(4s, 20));
  EXPECT_TRUE(leader.Confirm(kProofPatience));
}

TEST_F(EtcdElectionSilenceTest, OfAShortLeaseWholeSecondsSayTooLittle) {
  EtcdElection leader(*client_, "tessera", {.operators = "a:1", .players = ""}, {.ttl = 3s, .poll = 10ms});
  ASSERT_TRUE(leader.Campaign(kNobodyListens, kNobodyGivesUp).ok());
  etcd_.SetLeft(0s);
  EXPECT_FALSE(IsElected(3s, 20));
  EXPECT_TRUE(leader.Confirm(kProofPatience));
}

// By etcd's own word, whose leases have their time.
TEST(EtcdElectionRealTest, SomebodyElsesLeaseIsAskedFor) {
  const auto client = *EtcdClient::Make(RealEtcd::Shared().address("lease"), {});
  const auto granted = client->Grant(600s, kProofPatience);
  ASSERT_TRUE(granted.ok()) << granted.status();
  const auto lease = client->TimeToLive(granted->id(), kProofPatience);
  ASSERT_TRUE(lease.ok()) << lease.status();
  EXPECT_EQ(lease->granted, 600s);
  EXPECT_LE(lease->left, 600s);
  EXPECT_GT(lease->left, 300s);
  ASSERT_TRUE(client->Revoke(granted->id(), kProofPatience).ok());
  EXPECT_EQ(client->TimeToLive(granted->id(), kProofPatience).status().code(), absl::StatusCode::kNotFound);
}

// A lease that nobody renews, of eight seconds: the term is over with the sixth.
TEST(EtcdElectionRealTest, ASilentLeaderIsFollowedBeforeItsLeaseIsOver) {
  const EtcdAddress address = RealEtcd::Shared().address("silence");
  const auto client = *EtcdClient::Make(address, {});
  const auto granted = client->Grant(8s, kProofPatience);
  ASSERT_TRUE(granted.ok()) << granted.status();
  etcdserverpb::TxnRequest request;
  etcdserverpb::PutRequest& put = *request.add_success()->mutable_request_put();
  put.set_key(address.prefix + "/leader");
  put.set_value("a:1 -");
  put.set_lease(granted->id());
  ASSERT_TRUE(client->Write(request, kProofPatience).ok());
  EtcdElection next(*client, address.prefix, {.operators = "b:1", .players = ""}, kQuick);
  const auto fence = next.Campaign(kNobodyListens, kNobodyGivesUp);
  ASSERT_TRUE(fence.ok()) << fence.status();
  const auto left = client->TimeToLive(granted->id(), kProofPatience);
  if (left.ok()) {  // else this machine was so slow that etcd ended it first
    EXPECT_LT(left->left, 2s) << "and not before";
  }
}

TEST(LeaderAddressTest, IsTheSameAfterItWasRead) {
  for (const LeaderAddress& address :
       {LeaderAddress{.operators = "a:1", .players = "b:2"}, LeaderAddress{.operators = "", .players = "b:2"}}) {
    EXPECT_EQ(ReadLeaderAddress(ToText(address)), address);
  }
  EXPECT_EQ(ReadLeaderAddress("somebody"), std::nullopt);
}

// Three campaign at one etcd at once; each resigns when it has led.
TEST(EtcdElectionRealTest, OneLeadsAtATime) {
  const EtcdAddress address = RealEtcd::Shared().address("election");
  std::atomic<int> leading{0}, led{0};
  std::vector<std::thread> all;
  std::vector<std::int64_t> tokens(3);
  for (std::size_t i = 0; i < 3; ++i) {
    all.emplace_back([&, i] {
      const auto client = *EtcdClient::Make(address, {});
      EtcdElection election(*client, address.prefix, {.operators = "a:1", .players = ""}, kQuick);
      const auto fence = election.Campaign(kNobodyListens, kNobodyGivesUp);
      EXPECT_TRUE(fence.ok()) << fence.status();
      EXPECT_EQ(leading.fetch_add(1), 0);
      tokens[i] = fence->token;
      ++led;
      leading.fetch_sub(1);
      election.Resign();
    });
  }
  for (std::thread& thread : all) thread.join();
  EXPECT_EQ(led, 3);
  std::sort(tokens.begin(), tokens.end());
  EXPECT_LT(tokens[0], tokens[1]);
  EXPECT_LT(tokens[1], tokens[2]);
}

}  // namespace
}  // namespace tessera::control
