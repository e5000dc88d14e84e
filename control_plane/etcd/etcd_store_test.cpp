// Behaviour of EtcdStore beside the suite that every Store passes (store_test.cpp): deposed leaders, answers that are
// lost, an etcd that is full, chunks.
#include "control_plane/etcd/etcd_store.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <thread>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/etcd/etcd_election.h"
#include "control_plane/testing/fake_etcd.h"
#include "control_plane/testing/real_etcd.h"
#include "host/testing/watched_program.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;
using Fault = FakeEtcd::Fault;

// A control plane as far as etcd sees it.
struct Leader {
  explicit Leader(const EtcdAddress& address, const std::string& name = "a:1")
      : client(*EtcdClient::Make(address, {})), election(*client, address.prefix, {.operators = name, .players = ""}) {
    const auto won = election.Campaign([](const auto&) {}, [] { return false; });
    fence = *won;
    auto opened = EtcdStore::Open(*client, address.prefix, fence, [this] { ++lost; });
    EXPECT_TRUE(opened.ok()) << opened.status();
    store = *std::move(opened);
  }
  std::unique_ptr<EtcdClient> client;
  EtcdElection election;
  EtcdFence fence;
  int lost = 0;
  std::unique_ptr<EtcdStore> store;
};

class EtcdStoreTest : public ::testing::Test {
 protected:
  // So many came to etcd in all.
  void AwaitTransactions(int count) const {
    while (etcd_.transactions() < count) std::this_thread::yield();
  }

  FakeEtcd etcd_;
};

TEST_F(EtcdStoreTest, GoesOnWhereTheLeaderBeforeEnded) {
  Revision last = 0;
  {
    Leader first(etcd_.address());
    EXPECT_EQ(first.store->revision(), 0);
    ASSERT_TRUE(first.store->Put("a", "1", kAbsent).ok());
    last = *first.store->Put("b", "2", kAbsent);
    last = *first.store->Delete("b", last);
  }
  Leader second(etcd_.address());
  EXPECT_EQ(second.store->revision(), last);
  EXPECT_EQ(second.store->Get("a")->value, "1");
  EXPECT_EQ(second.store->List("")->size(), 1u);
  EXPECT_EQ(*ReadEtcdValue(*second.client, "tessera", "a"), "1");
  EXPECT_EQ(ReadEtcdValue(*second.client, "tessera", "b").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(EtcdStoreTest, ADeposedLeadersWriteFails) {
  Leader old(etcd_.address());
  const Revision first = *old.store->Put("a", "1", kAbsent);
  etcd_.ExpireLeases();
  Leader next(etcd_.address(), "b:1");
  EXPECT_GT(next.fence.token, old.fence.token);

  const auto late = old.store->Put("a", "deposed", first);
  EXPECT_EQ(late.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(late.status().message(), "store: this control plane no longer leads");
  EXPECT_EQ(old.lost, 1);
  EXPECT_EQ(old.store->Put("new", "x", kAbsent).status().message(), late.status().message());
  EXPECT_EQ(old.store->Put("scene", std::string(3'000'000, 'x'), kAbsent).status().message(), late.status().message());
  EXPECT_EQ(next.store->Get("a")->value, "1");
  EXPECT_EQ(next.store->List("")->size(), 1u);
  EXPECT_TRUE(next.store->Put("a", "2", first).ok());
}

TEST_F(EtcdStoreTest, WithNobodyElectedADeposedLeadersWriteFailsToo) {
  Leader old(etcd_.address());
  etcd_.ExpireLeases();
  EXPECT_EQ(old.store->Put("a", "1", kAbsent).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(etcd_.Value("tessera/data/a"), "");
}

TEST_F(EtcdStoreTest, AWriteWhoseAnswerWasLostHasTakenEffect) {
  Leader leader(etcd_.address());
  etcd_.FailNext({Fault::kLoseAnswer});
  const auto written = leader.store->Put("a", "1", kAbsent);
  ASSERT_TRUE(written.ok()) << written.status();
  EXPECT_EQ(leader.store->Get("a")->revision, *written);
  EXPECT_TRUE(leader.store->Put("a", "2", *written).ok());
}

TEST_F(EtcdStoreTest, AWriteThatNeverArrivedIsWrittenAgain) {
  Leader leader(etcd_.address());
  etcd_.FailNext({Fault::kLoseRequest});
  const auto written = leader.store->Put("a", "1", kAbsent);
  ASSERT_TRUE(written.ok()) << written.status();
  // Neither try arrives; the answer of the first barrier is lost besides.
  etcd_.FailNext({Fault::kLoseRequest, Fault::kLoseAnswer, Fault::kNone, Fault::kLoseRequest});
  const auto again = leader.store->Put("a", "2", *written);
  EXPECT_EQ(again.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(again.status().message()), HasSubstr("not written"));
  EXPECT_EQ(leader.store->Get("a")->value, "1");
  EXPECT_EQ(leader.lost, 0);
  EXPECT_TRUE(leader.store->Put("a", "3", *written).ok());
}

// Else the value that the caller was told had not been written would appear later.
TEST_F(EtcdStoreTest, AWriteThatArrivesLateIsVoid) {
  Leader leader(etcd_.address());
  etcd_.FailNext({Fault::kArriveLate, Fault::kNone, Fault::kArriveLate});
  EXPECT_EQ(leader.store->Put("a", "late", kAbsent).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(leader.store->Get("a").status().code(), absl::StatusCode::kNotFound);
  etcd_.DeliverLate();
  EXPECT_EQ(leader.store->Get("a").status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(leader.store->Put("a", "1", kAbsent).ok());
  EXPECT_EQ(leader.lost, 0);
}

// etcd's leader died with them: nobody would ever answer.
TEST_F(EtcdStoreTest, AWriteFromBeforeAnElectionOfEtcdIsEndedOnceTheNextLeaderAnswers) {
  const auto client = etcd_.Connect();
  etcdserverpb::RangeRequest read;
  read.set_key("x");
  ASSERT_TRUE(client->Range(read, kEtcdReadPatience).ok());
  etcd_.FailNext({Fault::kHang});
  etcdserverpb::TxnRequest request;
  request.add_success()->mutable_request_put()->set_key("x");
  auto write = std::async(std::launch::async, [&] { return client->Write(request, std::chrono::minutes(1)).status(); });
  AwaitTransactions(1);
  ASSERT_TRUE(client->Range(read, kEtcdReadPatience).ok()) << "an answer of the same leader ends nothing";
  etcd_.SetTerm(3);
  ASSERT_TRUE(client->Range(read, kEtcdReadPatience).ok());
  const absl::Status ended = write.get();
  EXPECT_TRUE(absl::IsCancelled(ended)) << ended;
  EXPECT_TRUE(EtcdClient::IsAmbiguous(ended));
}

TEST_F(EtcdStoreTest, WhatAnElectionOfEtcdLostIsWrittenAgain) {
  Leader leader(etcd_.address());
  const int before = etcd_.transactions();
  etcd_.FailNext({Fault::kHang});
  auto write = std::async(std::launch::async, [&] { return leader.store->Put("a", "1", kAbsent).status(); });
  AwaitTransactions(before + 1);
  etcd_.SetTerm(3);
  const absl::Status written = write.get();
  EXPECT_TRUE(written.ok()) << written;
  EXPECT_EQ(leader.store->Get("a")->value, "1");
  EXPECT_EQ(leader.lost, 0);
}

TEST_F(EtcdStoreTest, AFullEtcdIsNamedAndLosesNothing) {
  Leader leader(etcd_.address());
  const Revision first = *leader.store->Put("a", "1", kAbsent);
  etcd_.FailNext({Fault::kFull});
  const auto refused = leader.store->Put("a", "2", first);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("database space exceeded"));
  EXPECT_EQ(leader.store->Get("a")->revision, first);
  // The write that filled it is refused by name, and is there.
  etcd_.FailNext({Fault::kFullAfter});
  const auto written = leader.store->Put("a", "3", first);
  ASSERT_TRUE(written.ok()) << written.status();
  EXPECT_EQ(leader.store->Get("a")->revision, *written);
  EXPECT_EQ(leader.lost, 0);
}

TEST_F(EtcdStoreTest, SomebodyElsesWritesEndIt) {
  Leader leader(etcd_.address());
  ASSERT_TRUE(leader.store->Put("a", "1", kAbsent).ok());
  etcd_.Put("tessera/head", "tessera 1 another");
  const auto refused = leader.store->Put("b", "1", kAbsent);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("somebody else has written"));
  EXPECT_EQ(leader.lost, 1);
}

TEST_F(EtcdStoreTest, OldChunksGoWithTheValueTheyBelongedTo) {
  const auto chunks = [this] {
    const std::vector<std::string> keys = etcd_.Keys();
    return std::count_if(keys.begin(), keys.end(),
                         [](const std::string& key) { return key.starts_with("tessera/chunk/"); });
  };
  Leader leader(etcd_.address());
  const Revision first = *leader.store->Put("scene/1", std::string(2'500'000, 'a'), kAbsent);
  EXPECT_EQ(chunks(), 3);
  const Revision second = *leader.store->Put("scene/1", std::string(1'500'000, 'b'), first);
  EXPECT_EQ(chunks(), 2);
  ASSERT_TRUE(leader.store->Put("scene/2", std::string(1'500'000, 'c'), kAbsent).ok());
  EXPECT_EQ(chunks(), 4);
  // Chunks of a transaction that fails stay until the next leader; those of values do not go.
  etcd_.FailNext({Fault::kLoseAnswer, Fault::kLoseAnswer, Fault::kFull});
  EXPECT_FALSE(leader.store->Put("scene/3", std::string(1'500'000, 'd'), kAbsent).ok());
  EXPECT_GT(chunks(), 4);
  leader.election.Resign();
  Leader next(etcd_.address());
  EXPECT_EQ(chunks(), 4);
  EXPECT_TRUE(next.store->Get("scene/1")->value == std::string(1'500'000, 'b'));
  EXPECT_TRUE(*ReadEtcdValue(*next.client, "tessera", "scene/2") == std::string(1'500'000, 'c'));
  ASSERT_TRUE(next.store->Delete("scene/1", second).ok());
  EXPECT_EQ(chunks(), 2);
}

// The cluster goes on without them, and what is left of each is kept by name.
TEST_F(EtcdStoreTest, RecordsWhoseChunksAreGoneOrBrokenAreSetAside) {
  {
    Leader first(etcd_.address());
    ASSERT_TRUE(ClusterState::Load(*first.store).ok());
    for (const char* key : {"instance/1", "instance/2", "scene/feed"}) {
      ASSERT_TRUE(first.store->Put(key, std::string(1'500'000, 'x'), kAbsent).ok());
    }
    ASSERT_TRUE(first.store->Put("host/1", "", kAbsent).ok());
    first.election.Resign();
  }
  // Its pointer cannot be read; one chunk is another; all are gone.
  etcd_.Put("tessera/data/instance/1", "c nonsense");
  for (const std::string& key : etcd_.Keys()) {
    if (key.starts_with("tessera/chunk/") && key.ends_with("00000001")) etcd_.Put(key, "other bytes");
  }
  etcd_.Put("tessera/data/scene/feed", absl::StrCat("cnone 1500000 ", std::string(64, '0')));
  Leader next(etcd_.address());
  const auto state = ClusterState::Load(*next.store);
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_THAT((*state)->set_aside(), testing::UnorderedElementsAre("instance/1", "instance/2", "scene/feed"));
  EXPECT_NE((*state)->FindHost("host-1"), nullptr);
  EXPECT_EQ(next.store->List("instance/")->size(), 0U);
  EXPECT_EQ(next.store->Get("unreadable/2/instance/1")->value, "c nonsense");
  EXPECT_EQ(next.store->Get("unreadable/2/instance/2")->value.substr(0, 8), "xxxxxxxx");
  EXPECT_EQ(next.store->Get("unreadable/2/scene/feed")->value, "");
  const std::string folder = absl::StrCat("tessera/chunk/", absl::BytesToHexString("instance/"));
  for (const std::string& key : etcd_.Keys()) EXPECT_FALSE(key.starts_with(folder)) << key << " is left behind";
}

TEST_F(EtcdStoreTest, RefusesWhatIsNotAStoreOrNewer) {
  Leader leader(etcd_.address());
  etcd_.Put("tessera/head", "tessera 2 x");
  const auto newer = EtcdStore::Open(*leader.client, "tessera", leader.fence, nullptr);
  EXPECT_EQ(newer.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(newer.status().message()), HasSubstr("has version 2, this program knows 1: start the newer"));
  etcd_.Put("tessera/head", "something");
  EXPECT_THAT(std::string(EtcdStore::Open(*leader.client, "tessera", leader.fence, nullptr).status().message()),
              HasSubstr("is not that of a store"));
}

TEST_F(EtcdStoreTest, CompactsWhatIsOld) {
  Leader leader(etcd_.address());
  Revision last = kAbsent;
  for (int i = 0; i < 2001; ++i) last = *leader.store->Put("a", "x", last);
  EXPECT_GT(etcd_.compacted(), 900);
  EXPECT_LT(etcd_.compacted(), last - 900) << "others may still read what is a little old";
}

TEST_F(EtcdStoreTest, AnEtcdThatIsGoneEndsIt) {
  auto etcd = std::make_unique<FakeEtcd>();
  Leader leader(etcd->address());
  ASSERT_TRUE(leader.store->Put("a", "1", kAbsent).ok());
  etcd.reset();
  const auto refused = leader.store->Put("b", "1", kAbsent);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("it is not known whether a write took effect"));
  EXPECT_EQ(leader.lost, 1);
}

TEST(EtcdStoreRealTest, ADeposedLeadersWriteFails) {
  const EtcdAddress address = RealEtcd::Shared().address("deposed");
  Leader old(address);
  const Revision first = *old.store->Put("a", "1", kAbsent);
  old.election.Resign();
  Leader next(address, "b:1");
  EXPECT_EQ(old.store->Put("a", "x", first).status().message(), "store: this control plane no longer leads");
  EXPECT_TRUE(next.store->Put("a", "2", first).ok());
}

TEST(EtcdStoreRealTest, ChunksAndCompactionWorkThere) {
  const EtcdAddress address = RealEtcd::Shared().address("chunks");
  Leader leader(address);
  Revision scene = *leader.store->Put("scene", std::string(2'500'000, 'a'), kAbsent);
  scene = *leader.store->Put("scene", std::string(3'500'000, 'b'), scene);
  for (Revision i = 0, last = kAbsent; i < 2001; ++i) last = *leader.store->Put("a", "x", last);
  EXPECT_TRUE(leader.store->Get("scene")->value == std::string(3'500'000, 'b'));
  etcdserverpb::RangeRequest chunks;
  chunks.set_key("chunks/chunk/");
  chunks.set_range_end(EtcdRangeEnd("chunks/chunk/"));
  chunks.set_keys_only(true);
  EXPECT_EQ(leader.client->Range(chunks, kEtcdReadPatience)->kvs_size(), 4);
  EXPECT_EQ(leader.lost, 0);
}

// Nothing is ever read of the past, so whoever compacts the same etcd is in nobody's way.
TEST(EtcdStoreRealTest, GoesOnWhereSomebodyElseHasCompactedFurther) {
  const EtcdAddress address = RealEtcd::Shared().address("compacted");
  Leader leader(address);
  Revision scene = *leader.store->Put("scene", std::string(2'500'000, 'a'), kAbsent);
  const auto somebody = *EtcdClient::Make(address, {});
  Revision last = kAbsent;
  for (int i = 0; i < 2001; ++i) {
    const auto written = leader.store->Put("a", "x", last);
    ASSERT_TRUE(written.ok()) << written.status();
    last = *written;
    // Before ours is due, which then has nothing left to do, and etcd says so.
    if (i % 500 != 0) continue;
    ASSERT_TRUE(somebody->Compact(last, kEtcdWritePatience).ok());
  }
  EXPECT_TRUE(absl::IsOutOfRange(somebody->Compact(scene, kEtcdWritePatience))) << "it is compacted";
  EXPECT_EQ(leader.lost, 0);
  leader.election.Resign();
  Leader next(address, "b:1");
  EXPECT_EQ(next.store->Get("scene")->value.size(), 2'500'000U);
  EXPECT_EQ(next.store->Get("a")->revision, last);
}

}  // namespace
}  // namespace tessera::control
