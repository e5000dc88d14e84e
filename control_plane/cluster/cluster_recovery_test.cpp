// A control plane that begins from a backup while its worlds run, under a virtual clock: what runs is taken up as it
// runs, whatever happened since the backup was made.
#include <gmock/gmock.h>

#include <chrono>
#include <map>
#include <string>

#include "control_plane/backup.h"
#include "control_plane/control_settings.h"
#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

std::map<std::string, std::size_t> StartsOf(const ClusterHarness& harness) {
  std::map<std::string, std::size_t> starts;
  for (const auto& [name, agent] : harness.agents) starts[name] = agent.fake.starts.size();
  return starts;
}

void DeleteWorld(ClusterHarness& harness, const std::string& id) {
  v1::DeleteInstanceRequest request;
  request.set_id(id);
  ASSERT_TRUE(harness.cluster().DeleteInstance(harness.now, request).ok());
  harness.Run(seconds(2));
}

class RecoveryTest : public ::testing::Test {
 protected:
  RecoveryTest() {
    harness_.AddHost("alpha", 16);
    harness_.AddHost("beta", 16);
  }

  ClusterHarness harness_;
};

TEST_F(RecoveryTest, NothingThatRunsIsTouchedWhereNothingHappenedSince) {
  const std::string id = Start(harness_, 4);
  const std::string backup = harness_.Backup();
  const auto starts = StartsOf(harness_);
  const std::string map = harness_.Get(id).map().SerializeAsString();
  harness_.BeginFrom(backup);
  harness_.Run(seconds(5));
  EXPECT_FALSE(harness_.cluster().state().recovering());
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(harness_.Get(id).map().SerializeAsString(), map);
  EXPECT_EQ(StartsOf(harness_), starts) << "no worker was started";
  EXPECT_EQ(harness_.Workers(), 4u) << "and none was ended";
  EXPECT_EQ(harness_.Get(id).failovers(), 0u);
  EXPECT_THAT(harness_.Get(id).events().rbegin()->text(), HasSubstr("taken up as it runs"));
}

TEST_F(RecoveryTest, AWorldThatWasScaledAndJoinedSinceIsTakenUpAsItRuns) {
  const std::string id = Start(harness_, 2);
  const std::string backup = harness_.Backup();
  v1::ScaleInstanceRequest scale;
  scale.set_id(id);
  scale.set_regions(4);
  ASSERT_TRUE(harness_.cluster().ScaleInstance(harness_.now, scale).ok());
  harness_.Run(seconds(20));
  ASSERT_EQ(harness_.Get(id).map().regions_size(), 4);
  const auto ann = harness_.cluster().Join(harness_.now, JoinRequest(id, "ann"));
  ASSERT_TRUE(ann.ok()) << ann.status();
  harness_.Run(seconds(1));
  const auto starts = StartsOf(harness_);
  const std::string map = harness_.Get(id).map().SerializeAsString();

  harness_.BeginFrom(backup);
  harness_.Run(seconds(5));
  const v1::Instance world = harness_.Get(id);
  EXPECT_EQ(world.state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(world.map().SerializeAsString(), map) << "not set back to two regions";
  EXPECT_EQ(StartsOf(harness_), starts);
  ExpectEachBodyOnce(harness_, 2);
  ASSERT_EQ(world.player_list_size(), 1);
  EXPECT_EQ(world.player_list(0).name(), "ann");
  const auto bob = harness_.cluster().Join(harness_.now, JoinRequest(id, "bob"));
  ASSERT_TRUE(bob.ok()) << bob.status();
  EXPECT_GT(bob->response.player(), ann->response.player()) << "a number is given once";

  // It goes on being managed: a region that dies is carried on and replaced.
  FakeHost& host = harness_.AgentOf(id, world.map().regions(0).id());
  harness_.Send(host, host.fake.Kill({id, world.map().regions(0).id()}, 9));
  harness_.Run(seconds(20));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(harness_.Get(id).failovers(), 1u);
  EXPECT_EQ(harness_.Get(id).map().regions_size(), 4);
  EXPECT_EQ(harness_.Workers(), 4u);
  ExpectEachBodyOnce(harness_, 2);
  ExpectNoIncarnationTwice(harness_);
}

TEST_F(RecoveryTest, TheSameBackupMayBeBegunFromTwiceAndNoNumberIsGivenTwice) {
  const std::string id = Start(harness_, 2);
  const std::string backup = harness_.Backup();
  harness_.BeginFrom(backup);
  harness_.Run(seconds(5));
  ASSERT_TRUE(Scale(harness_, id, 3).ok());
  harness_.Run(seconds(20));
  const auto ann = harness_.cluster().Join(harness_.now, JoinRequest(id, "ann"));
  ASSERT_TRUE(ann.ok()) << ann.status();
  const std::string unknown = Start(harness_, 1);
  harness_.Run(seconds(1));
  const records::Instance before = harness_.cluster().state().FindInstance(id)->record;
  const std::uint64_t revision = harness_.cluster().state().last_revision();

  harness_.BeginFrom(backup);
  harness_.Run(seconds(5));
  EXPECT_GT(harness_.cluster().state().last_revision(), revision) << "workers take no earlier orders";
  const records::Instance& record = harness_.cluster().state().FindInstance(id)->record;
  EXPECT_EQ(record.map().regions_size(), 3) << "taken up as it runs";
  EXPECT_GT(record.last_incarnation(), before.last_incarnation());
  EXPECT_GT(record.last_map_version(), before.last_map_version());
  EXPECT_NE(Start(harness_, 1), unknown) << "whose workers run still";
  const auto bob = harness_.cluster().Join(harness_.now, JoinRequest(id, "bob"));
  ASSERT_TRUE(bob.ok()) << bob.status();
  EXPECT_GT(bob->response.player(), ann->response.player());
  ASSERT_TRUE(Scale(harness_, id, 2).ok());
  harness_.Run(seconds(20));
  EXPECT_EQ(harness_.Get(id).map().regions_size(), 2) << "its workers do what they are ordered";
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness_.Get(id).reason();
  ExpectNoIncarnationTwice(harness_);
}

TEST_F(RecoveryTest, AHostThatClaimsALifeBeyondAllRestoresIsNotBelieved) {
  const std::string backup = harness_.Backup();
  harness_.BeginFrom(backup);
  const std::uint64_t revision = harness_.cluster().state().last_revision();
  FakeHost& alpha = harness_.agents.at("alpha");
  v1::AgentHello hello = ClusterHarness::Hello(16);
  hello.set_host_id(alpha.host_id);
  hello.set_host_secret(alpha.secret);
  hello.set_newest_life(std::uint64_t{1} << 31);
  ASSERT_TRUE(harness_.cluster().HandleHello(harness_.now, hello).ok());
  EXPECT_EQ(harness_.cluster().state().last_revision(), revision);
  hello.set_newest_life((revision >> kLifeShift) + 7);
  ASSERT_TRUE(harness_.cluster().HandleHello(harness_.now, hello).ok());
  EXPECT_EQ(harness_.cluster().state().last_revision() >> kLifeShift, (revision >> kLifeShift) + 8);
}

TEST_F(RecoveryTest, AWorldIsCalledRunningOnceItIsKnownToStep) {
  const std::string id = Start(harness_, 4);
  const std::string backup = harness_.Backup();
  harness_.agents.at("beta").silent = true;
  harness_.BeginFrom(backup);
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_DEGRADED) << "nobody has been heard yet";
  harness_.Run(seconds(5));
  ASSERT_TRUE(harness_.cluster().state().recovering());
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_EQ(harness_.Get(id).reason(), "not known to step yet: 1 of 2 hosts have said what they run");
  harness_.agents.at("beta").silent = false;
  harness_.Run(seconds(1));
  EXPECT_FALSE(harness_.cluster().state().recovering());
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness_.Get(id).reason();
}

TEST_F(RecoveryTest, AWorldWhoseRegionsAllStepIsRunningThoughAnotherHostIsAwaited) {
  const std::string id = Start(harness_, 4);
  harness_.AddHost("gamma", 1);
  const std::string backup = harness_.Backup();
  harness_.agents.at("gamma").silent = true;
  harness_.BeginFrom(backup);
  harness_.Run(seconds(2));
  ASSERT_TRUE(harness_.cluster().state().recovering());
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness_.Get(id).reason();
  for (auto& [name, agent] : harness_.agents) agent.fake.still = {1};
  harness_.Run(seconds(4));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
}

TEST_F(RecoveryTest, WhatEndedSinceIsNotBegunAgain) {
  const std::string gone = Start(harness_, 2), stays = Start(harness_, 2);
  const std::string backup = harness_.Backup();
  DeleteWorld(harness_, gone);
  const auto starts = StartsOf(harness_);
  harness_.BeginFrom(backup);
  harness_.Run(seconds(5));
  EXPECT_EQ(harness_.Get(gone).state(), v1::INSTANCE_STATE_ENDED);
  EXPECT_THAT(harness_.Get(gone).reason(), HasSubstr("ran on none of its hosts"));
  EXPECT_EQ(harness_.Get(stays).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(StartsOf(harness_), starts);
}

TEST_F(RecoveryTest, AWorldThatWasMadeSinceRunsOnUnknownUntilSomebodyEndsIt) {
  const std::string backup = harness_.Backup();
  const std::string unknown = Start(harness_, 3);
  const auto starts = StartsOf(harness_);
  harness_.BeginFrom(backup);
  harness_.Run(seconds(5));
  EXPECT_EQ(harness_.Workers(), 3u) << "none was ended";
  EXPECT_EQ(StartsOf(harness_), starts);
  EXPECT_FALSE(GetInstance(harness_.cluster().state(), unknown).ok());
  int told = 0;
  for (const auto& [number, host] : harness_.cluster().state().hosts()) told += host.record.unknown_workers_size();
  EXPECT_EQ(told, 3);

  harness_.Restart();
  harness_.Run(seconds(2));
  EXPECT_EQ(harness_.Workers(), 3u) << "nor by the next control plane";
  EXPECT_NE(Start(harness_, 1), unknown) << "its id is not given again";
  EXPECT_EQ(harness_.Workers(), 4u);
  DeleteWorld(harness_, unknown);
  EXPECT_EQ(harness_.Workers(), 1u);
}

TEST_F(RecoveryTest, AFailoverThatWasUnderWayIsCarriedOut) {
  const std::string id = Start(harness_, 4);
  const std::string backup = harness_.Backup();
  const std::uint32_t dead = harness_.Get(id).map().regions(1).id();
  FakeHost& host = harness_.AgentOf(id, dead);
  for (auto& [name, agent] : harness_.agents) agent.fake.mute = true;  // no inventories: it does not come to its end
  harness_.Send(host, host.fake.Kill({id, dead}, 9));
  harness_.Pump();
  ASSERT_TRUE(harness_.cluster().state().FindInstance(id)->record.has_failover());

  harness_.BeginFrom(backup);
  for (auto& [name, agent] : harness_.agents) agent.fake.mute = false;
  harness_.Run(seconds(20));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(harness_.Get(id).map().regions_size(), 4) << "the dead one was replaced";
  ExpectEachBodyOnce(harness_, 4);
  ExpectNoIncarnationTwice(harness_);
}

// Its orders went with it, and nobody's names it as a peer any more.
TEST_F(RecoveryTest, ARegionThatNobodyKnowsAnyMoreIsCarriedOnAndDoesNotBeginAnew) {
  const std::string id = Start(harness_, 4);
  const std::string backup = harness_.Backup();
  FakeHost& host = harness_.AgentOf(id, 2);
  host.fake.workers.erase({id, 2});
  for (auto& [name, agent] : harness_.agents) {
    for (auto& [key, worker] : agent.fake.workers) worker.order.clear_peers();
  }
  harness_.BeginFrom(backup);
  harness_.Run(seconds(20));
  ASSERT_FALSE(harness_.cluster().state().recovering());
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness_.Get(id).reason();
  EXPECT_EQ(harness_.Get(id).failovers(), 1u);
  ExpectEachBodyOnce(harness_, 4);
  ExpectNoIncarnationTwice(harness_);
}

TEST_F(RecoveryTest, AHostThatDoesNotComeIsWaitedForAndThenSilentLikeAnyOther) {
  const std::string id = Start(harness_, 4);
  const std::string backup = harness_.Backup();
  harness_.agents.at("beta").silent = true;
  harness_.BeginFrom(backup);
  harness_.Run(seconds(10));
  EXPECT_TRUE(harness_.cluster().state().recovering());
  EXPECT_EQ(harness_.Get(id).failovers(), 0u) << "nobody is declared dead meanwhile";
  harness_.Run(kRecoverPatience);
  EXPECT_FALSE(harness_.cluster().state().recovering());
  harness_.Run(seconds(20));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness_.Get(id).reason();
  EXPECT_EQ(harness_.Get(id).failovers(), 1u);
}

TEST_F(RecoveryTest, ItGoesOnFromTheBeginningWhenTheControlPlaneDiesMeanwhile) {
  const std::string id = Start(harness_, 4);
  const std::string backup = harness_.Backup();
  const auto starts = StartsOf(harness_);
  harness_.agents.at("beta").silent = true;
  harness_.BeginFrom(backup);
  harness_.Run(seconds(1));
  harness_.Restart();
  harness_.agents.at("beta").silent = false;
  harness_.Run(seconds(5));
  EXPECT_FALSE(harness_.cluster().state().recovering());
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(StartsOf(harness_), starts);
}

TEST_F(RecoveryTest, NobodyHasALeaseBeforeItIsKnownWhatRuns) {
  const std::string id = Start(harness_, 2);
  const std::string backup = harness_.Backup();
  FakeHost& home = harness_.AgentOf(id, 1);
  harness_.agents.at("beta").silent = true;
  harness_.BeginFrom(backup);
  harness_.Run(milliseconds(500));
  ASSERT_TRUE(harness_.cluster().state().recovering());
  v1::AgentMessage ask;
  *ask.mutable_lease()->mutable_identity() = home.fake.workers.at({id, 1}).report.identity();
  if (home.stream == 0) harness_.Attach(home);
  harness_.cluster().TakeEffects();
  harness_.Send(home, ask);
  EXPECT_TRUE(harness_.cluster().TakeEffects().leases.empty()) << "it may have been carried on elsewhere since";

  harness_.agents.at("beta").silent = false;
  harness_.Run(seconds(5));
  ASSERT_FALSE(harness_.cluster().state().recovering());
  harness_.cluster().TakeEffects();
  harness_.Send(home, ask);
  EXPECT_EQ(harness_.cluster().TakeEffects().leases.size(), 1u);
}

TEST_F(RecoveryTest, ItEndsOnceWhatItFoundCanBeStored) {
  const std::string id = Start(harness_, 2);
  const std::string backup = harness_.Backup();
  harness_.BeginFrom(backup);
  harness_.store.FailNext(3);
  harness_.Run(milliseconds(250));
  EXPECT_TRUE(harness_.cluster().state().recovering());
  harness_.Run(seconds(5));
  EXPECT_FALSE(harness_.cluster().state().recovering());
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
}

}  // namespace
}  // namespace tessera::control
