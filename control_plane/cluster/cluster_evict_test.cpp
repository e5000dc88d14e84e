// A host that is not to be trusted any more, under a virtual clock: what runs on it is carried on elsewhere, and not
// before it must stand still.
#include <gmock/gmock.h>

#include <chrono>
#include <string>

#include "control_plane/cluster/hosts.h"
#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

absl::Status Evict(ClusterHarness& harness, const std::string& name) {
  v1::RemoveHostRequest request;
  request.set_name(name);
  request.set_force(true);
  harness.agents.at(name).silent = true;  // whatever it does from now on, nobody hears it
  return harness.cluster().RemoveHost(harness.now, request);
}

// The evicted host's workers still send their logs to their standbys.
void RunWhileItGoesOn(ClusterHarness& harness, FakeHost& other, milliseconds span) {
  for (milliseconds passed{0}; passed < span; passed += milliseconds(250)) {
    for (auto& [key, worker] : other.fake.workers) {
      for (v1::StandbyStatus& held : *worker.report.mutable_standby_copies()) held.set_tick(held.tick() + 15);
    }
    harness.Run(milliseconds(250));
  }
}

TEST(EvictTest, ItsRegionsAreCarriedOnOnceTheirLeasesHaveRunOut) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 8);
  auto& beta = harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  const std::size_t there = beta.fake.workers.size();
  ASSERT_GT(there, 0u);
  ASSERT_LT(there, 4u);
  ASSERT_TRUE(Evict(harness, "beta").ok());
  harness.Run(milliseconds(500));
  EXPECT_EQ(harness.Get(id).failovers(), 0u) << "they may still step";
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_THAT(harness.Get(id).events().rbegin()->text(), HasSubstr("host beta was evicted"));
  RunWhileItGoesOn(harness, alpha, seconds(3));
  EXPECT_EQ(harness.Get(id).failovers(), 1u) << "copies that grow are no sign that it is to be believed";
  harness.Run(seconds(10));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(alpha.fake.workers.size(), 4u) << "all are replaced, on the other host";
}

TEST(EvictTest, NothingThatItShowsIsAcceptedAndItsNameIsFree) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  auto& beta = harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  harness.cluster().TakeEffects();
  const StreamId stream = beta.stream;
  ASSERT_TRUE(Evict(harness, "beta").ok());
  EXPECT_EQ(harness.cluster().TakeEffects().closed.at(stream).code(), absl::StatusCode::kPermissionDenied);
  v1::AgentHello hello = ClusterHarness::Hello(8);
  hello.set_host_id(beta.host_id);
  hello.set_host_secret(beta.secret);
  EXPECT_EQ(harness.cluster().HandleHello(harness.now, hello).status().code(), absl::StatusCode::kPermissionDenied);
  v1::AgentMessage heartbeat;
  heartbeat.mutable_heartbeat();
  EXPECT_FALSE(harness.cluster().HandleAgentMessage(harness.now, stream, heartbeat).ok());
  harness.Restart();
  EXPECT_EQ(harness.cluster().HandleHello(harness.now, hello).status().code(), absl::StatusCode::kPermissionDenied);
  v1::AddHostRequest again;
  again.set_name("beta");
  EXPECT_TRUE(harness.cluster().AddHost(harness.now, again).ok());
}

TEST(EvictTest, AControlPlaneThatDiesThereafterBringsItToAnEnd) {
  for (int calls = 0; calls < 12; ++calls) {
    SCOPED_TRACE(calls);
    ClusterHarness harness;
    auto& alpha = harness.AddHost("alpha", 8);
    harness.AddHost("beta", 4);
    const std::string id = Start(harness, 4);
    ASSERT_TRUE(Evict(harness, "beta").ok());
    harness.calls_until_death = calls;
    RunWhileItGoesOn(harness, alpha, seconds(4));
    EXPECT_EQ(harness.Get(id).failovers(), 1u);
    harness.Run(seconds(10));
    EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  }
}

TEST(EvictTest, AWorldThatLivedThereAloneDoesNotPretendToRun) {
  ClusterHarness harness;
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  ASSERT_TRUE(Evict(harness, "beta").ok());
  harness.Run(seconds(5));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(harness.Get(id).reason(), HasSubstr("host beta was evicted"));
}

TEST(EvictTest, AWorldThatEndsDoesNotWaitForIt) {
  ClusterHarness harness;
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 2);
  v1::DeleteInstanceRequest end;
  end.set_id(id);
  harness.agents.at("beta").silent = true;
  ASSERT_TRUE(harness.cluster().DeleteInstance(harness.now, end).ok());
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_STOPPING);
  ASSERT_TRUE(Evict(harness, "beta").ok());
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_ENDED);
}

TEST(EvictTest, WithoutForceOrInADryRunNothingHappens) {
  ClusterHarness harness;
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 2);
  v1::RemoveHostRequest request;
  request.set_name("beta");
  const absl::Status refused = harness.cluster().RemoveHost(harness.now, request);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("drain it first, or evict it by force"));
  request.set_force(true);
  request.set_validate_only(true);
  EXPECT_TRUE(harness.cluster().RemoveHost(harness.now, request).ok());
  harness.Run(seconds(2));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_NE(FindHostByName(harness.cluster().state(), "beta"), nullptr);
}

TEST(HostCapacityTest, IsBelievedOnlyAsFarAsItMayBe) {
  ClusterHarness harness;
  v1::AddHostRequest add;
  add.set_name("greedy");
  add.set_max_regions(1001);
  EXPECT_EQ(harness.cluster().AddHost(harness.now, add).status().message(), "max_regions: must be 1 to 1000, got 1001");
  add.set_max_regions(3);
  const auto added = harness.cluster().AddHost(harness.now, add);
  ASSERT_TRUE(added.ok()) << added.status();
  v1::AgentHello hello = ClusterHarness::Hello(4'000'000'000);
  hello.set_join_token(added->join_token());
  ASSERT_TRUE(harness.cluster().HandleHello(harness.now, hello).ok());
  EXPECT_EQ(harness.cluster().CreateInstance(harness.now, TestPlan(4), false).status().code(),
            absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(harness.cluster().CreateInstance(harness.now, TestPlan(3), false).ok());
}

TEST(HostCapacityTest, AWorkerThatReportsWhatNoneMayIsReplaced) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  auto& agent = harness.AgentOf(id, 2);
  v1::AgentMessage message;
  *message.mutable_report() = agent.fake.workers.at({id, 2}).report;
  for (std::uint32_t i = 0; i < 100'000; ++i) message.mutable_report()->add_connected_players(i);
  harness.Send(agent, message);
  EXPECT_THAT(harness.Get(id).events().rbegin()->text(),
              HasSubstr("worker refused: report.connected_players: has 100000 entries, at most 10000"));
  harness.Run(seconds(15));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(harness.Get(id).failovers(), 1u) << "the others of its host live on";
}

}  // namespace
}  // namespace tessera::control
