// A control plane that finds records that it cannot read while worlds run, under a virtual clock.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <string>

#include "control_plane/stored_records.h"
#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr char kSpoilt[] = "\xff\xff";

class ClusterSetAsideTest : public ::testing::Test {
 protected:
  ClusterSetAsideTest() {
    harness_.AddHost("alpha", 16);
    harness_.AddHost("beta", 16);
  }
  void Spoil(const std::string& key) {
    ASSERT_TRUE(harness_.store.Put(key, kSpoilt, harness_.store.Get(key)->revision).ok()) << key;
  }

  ClusterHarness harness_;
};

TEST_F(ClusterSetAsideTest, AWorldWhoseRecordIsSpoiltRunsOnAndTheOthersAreManaged) {
  const std::string spoilt = Start(harness_, 3), sound = Start(harness_, 2);
  Spoil(InstanceKey(1));
  harness_.Restart();
  harness_.Run(seconds(5));
  EXPECT_FALSE(harness_.cluster().state().recovering());
  EXPECT_EQ(harness_.Workers(), 5u) << "none was ended";
  EXPECT_FALSE(GetInstance(harness_.cluster().state(), spoilt).ok());
  EXPECT_EQ(harness_.Get(sound).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(harness_.Get(sound).failovers(), 0u);

  FakeHost& host = harness_.AgentOf(sound, 1);
  harness_.Send(host, host.fake.Kill({sound, 1}, 9));
  harness_.Run(seconds(20));
  EXPECT_EQ(harness_.Get(sound).failovers(), 1u);

  v1::DeleteInstanceRequest request;
  request.set_id(spoilt);
  ASSERT_TRUE(harness_.cluster().DeleteInstance(harness_.now, request).ok());
  harness_.Run(seconds(2));
  EXPECT_EQ(harness_.Workers(), 2u) << "it ends when somebody asks for it";
}

TEST_F(ClusterSetAsideTest, ASoundWorldThatStoppedWithAllHostsIsNotTakenForOneThatEnded) {
  const std::string sound = Start(harness_, 2);
  const std::string spoilt = Start(harness_, 2);
  Spoil(InstanceKey(2));
  for (auto& [name, agent] : harness_.agents) agent.silent = true;
  harness_.Restart();
  harness_.Run(seconds(40));
  EXPECT_EQ(StateOf(harness_.cluster().state(), sound), v1::INSTANCE_STATE_DEGRADED);
}

TEST_F(ClusterSetAsideTest, PlayersThatAreSetAsideComeBackFromTheRegions) {
  const std::string id = Start(harness_, 2);
  const auto ann = harness_.cluster().Join(harness_.now, JoinRequest(id, "ann"));
  ASSERT_TRUE(ann.ok()) << ann.status();
  harness_.Run(seconds(1));
  const auto buckets = harness_.store.List("players/");
  ASSERT_EQ(buckets->size(), 1u);
  Spoil(buckets->front().key);
  harness_.Restart();
  harness_.Run(seconds(5));
  const v1::Instance world = harness_.Get(id);
  EXPECT_EQ(world.state(), v1::INSTANCE_STATE_RUNNING);
  ASSERT_EQ(world.player_list_size(), 1) << "an order without her would have expelled her";
  EXPECT_EQ(world.player_list(0).name(), "ann");
  EXPECT_TRUE(std::any_of(world.events().begin(), world.events().end(), [](const v1::InstanceEvent& event) {
    return event.text().find("taken up from the regions") != std::string::npos;
  }));
  const auto bob = harness_.cluster().Join(harness_.now, JoinRequest(id, "bob"));
  ASSERT_TRUE(bob.ok()) << bob.status();
  EXPECT_GT(bob->response.player(), ann->response.player());
}

TEST_F(ClusterSetAsideTest, WhatRevokesStopsTheStart) {
  Spoil(kRevocationsKey);
  const auto cluster = Cluster::Load(
      harness_.store, {}, [](std::size_t n) { return std::string(n, 'r'); }, harness_.now);
  EXPECT_EQ(cluster.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(cluster.status().message()), HasSubstr(kRevocationsKey));
}

TEST_F(ClusterSetAsideTest, AccessIssuersTicketsAndMessagesAreSetAsideOneByOne) {
  for (const char* key : {"token/ann", "issuer/game", "ticket/feed", "message/1/00000000000000000001", "visual/feed"}) {
    ASSERT_TRUE(harness_.store.Put(key, kSpoilt, kAbsent).ok());
  }
  harness_.Restart();
  EXPECT_EQ(harness_.cluster().state().set_aside().size(), 5u);
  EXPECT_FALSE(harness_.cluster().state().recovering()) << "no worker depends on them";
}

}  // namespace
}  // namespace tessera::control
