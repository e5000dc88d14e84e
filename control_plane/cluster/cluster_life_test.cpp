// An instance's life under a virtual clock: starts, failures, ends, and a control plane that dies in between.
#include <gmock/gmock.h>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

void Delete(ClusterHarness& harness, const std::string& id) {
  v1::DeleteInstanceRequest request;
  request.set_id(id);
  const auto deleted = harness.cluster().DeleteInstance(harness.now, request);
  EXPECT_TRUE(deleted.ok()) << deleted.status();
}

TEST(InstanceLifeTest, RunsAtOnceWithoutExpectedPlayers) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(4));
  EXPECT_EQ(id, "inst-1");
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_STARTING);
  harness.Pump();
  const v1::Instance instance = harness.Get(id);
  EXPECT_EQ(instance.state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(instance.region_status_size(), 4);
  EXPECT_TRUE(instance.has_start_time());
  for (const auto& [key, worker] : harness.agents["alpha"].fake.workers) {
    EXPECT_TRUE(worker.order.run());
    EXPECT_EQ(worker.order.peers_size(), 3);
    EXPECT_EQ(worker.order.instance_key().size(), 32u);
    for (const v1::RegionAddress& peer : worker.order.peers()) {
      EXPECT_EQ(peer.host(), "10.0.0.1");
      EXPECT_NE(peer.region(), key.second);
    }
  }
}

TEST(InstanceLifeTest, WaitsForItsPlayers) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  agent.fake.connect_players = false;
  const std::string id = Create(harness, TestPlan(2, 2));
  harness.Pump();
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_WAITING_FOR_PLAYERS);
  ASSERT_TRUE(harness.cluster().Join(harness.now, JoinRequest(id)).ok());
  ASSERT_TRUE(harness.cluster().Join(harness.now, JoinRequest(id)).ok());
  harness.Pump();
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_WAITING_FOR_PLAYERS);  // joined, but not connected
  v1::AgentMessage message;
  for (auto& [key, worker] : agent.fake.workers) {
    EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_WAITING_FOR_PLAYERS);  // not to all regions yet
    worker.report.add_connected_players(1);
    worker.report.add_connected_players(2);
    *message.mutable_report() = worker.report;
    harness.Send(agent, message);
  }
  harness.Pump();
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
}

TEST(InstanceLifeTest, StartsWithoutMissingPlayersAtItsDeadline) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(2, 2));
  harness.Run(seconds(29));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_WAITING_FOR_PLAYERS);
  harness.Run(seconds(2));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
}

TEST(InstanceLifeTest, ALazyInstanceStartsItsWorkersWhenThePlayersAreThere) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  InstancePlan plan = TestPlan(4, 2);
  plan.lazy = true;
  const std::string id = Create(harness, plan);
  harness.Pump();
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_PENDING);
  EXPECT_EQ(harness.Workers(), 0u);
  // Its places are its own already.
  EXPECT_EQ(harness.cluster().CreateInstance(harness.now, TestPlan(1), false).status().code(),
            absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(harness.cluster().BeginWait(harness.now, JoinRequest(id)).ok());
  harness.Pump();
  EXPECT_EQ(harness.Workers(), 0u);
  EXPECT_FALSE(*CanJoin(harness.cluster().state(), id));
  ASSERT_TRUE(harness.cluster().BeginWait(harness.now, JoinRequest(id)).ok());
  harness.Pump();
  EXPECT_EQ(harness.Workers(), 4u);
  for (int player = 0; player < 2; ++player) {
    ASSERT_TRUE(harness.cluster().Join(harness.now, JoinRequest(id)).ok());
    harness.cluster().EndWait(harness.now, id);
  }
  harness.Pump();
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
}

TEST(InstanceLifeTest, ALazyInstanceFindsOtherHostsIfItsOwnAreGone) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 4);
  InstancePlan plan = TestPlan(2, 1);
  plan.lazy = true;
  plan.start_deadline = std::chrono::hours(1);
  const std::string id = Create(harness, plan);
  alpha.silent = true;
  harness.Run(seconds(6));
  ASSERT_TRUE(harness.cluster().BeginWait(harness.now, JoinRequest(id)).ok());
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_PLACING);
  EXPECT_EQ(harness.Get(id).reason(), "2 regions need 2 places; no host is ready");
  harness.AddHost("beta", 4);
  harness.Run(seconds(1));
  EXPECT_EQ(harness.Get(id).region_status(0).host(), "beta");
  EXPECT_TRUE(*CanJoin(harness.cluster().state(), id));
}

TEST(InstanceLifeTest, NothingIsMadeWithoutRoom) {
  ClusterHarness harness;
  harness.AddHost("alpha", 2);
  const Revision before = harness.store.revision();
  const auto made = harness.cluster().CreateInstance(harness.now, TestPlan(4), false);
  EXPECT_EQ(made.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(made.status().message(), "4 regions need 4 places; the 1 ready host has 2 free");
  EXPECT_EQ(harness.store.revision(), before);
  EXPECT_EQ(ListInstances(harness.cluster().state(), {})->instances_size(), 0);
  EXPECT_EQ(Create(harness, TestPlan(2)), "inst-1");
}

TEST(InstanceLifeTest, ADryRunPlacesAndMakesNothing) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  const auto planned = harness.cluster().CreateInstance(harness.now, TestPlan(4), true);
  ASSERT_TRUE(planned.ok());
  EXPECT_EQ(planned->region_status_size(), 4);
  EXPECT_EQ(planned->region_status(0).host(), "alpha");
  EXPECT_EQ(ListInstances(harness.cluster().state(), {})->instances_size(), 0);
}

TEST(InstanceLifeTest, TheSameRequestMakesOneInstance) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  InstancePlan plan = TestPlan(2);
  plan.request_id = "launch-1";
  EXPECT_EQ(Create(harness, plan), "inst-1");
  EXPECT_EQ(Create(harness, plan), "inst-1");
  harness.Restart();
  EXPECT_EQ(Create(harness, plan), "inst-1");
  plan.request_id = "launch-2";
  EXPECT_EQ(Create(harness, plan), "inst-2");
}

TEST(InstanceLifeTest, AWorkerThatExitsAtStartFailsTheWholeInstance) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  agent.fake.exit_at_start = {3};
  const std::string id = Create(harness, TestPlan(4));
  harness.Pump();
  const v1::Instance instance = harness.Get(id);
  EXPECT_EQ(instance.state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_EQ(instance.reason(), "region 3 on alpha: worker exited with code 3; last log: two | three | no such mesh");
  EXPECT_EQ(harness.Workers(), 0u);
  EXPECT_EQ(instance.region_status_size(), 0);
  agent.fake.exit_at_start = {};
  Create(harness, TestPlan(8));  // all places are free again
}

TEST(InstanceLifeTest, TheOnlyWorkersDeathFailsTheInstanceAndNamesWhere) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(1));
  harness.Pump();
  harness.Send(agent, agent.fake.Kill({id, 1}, 9));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_EQ(harness.Get(id).reason(), "region 1 on alpha: worker was killed by signal 9");
  harness.Pump();
  EXPECT_EQ(harness.Workers(), 0u);
}

TEST(InstanceLifeTest, AWorkerThatVanishesUnseenIsNotStartedAgain) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(4));
  harness.Pump();
  agent.fake.Kill({id, 2}, 9);  // and nobody hears of it
  harness.Restart();            // nor does anybody remember that it ran
  harness.Run(seconds(3));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(harness.Get(id).failovers(), 1u);
  EXPECT_THAT(harness.Get(id).events(0).text(),
              HasSubstr("region 2 on alpha: worker ended unseen: the agent of its host"));
  ExpectNoIncarnationTwice(harness);
}

// Nobody else has a copy: it may well run on, and is not given up.
TEST(InstanceLifeTest, ASilentHostDegradesAndItsReturnHeals) {
  ClusterHarness harness;
  auto& beta = harness.AddHost("beta", 4);
  const std::string id = Create(harness, TestPlan(4));
  harness.Pump();
  beta.silent = true;
  harness.Run(seconds(6));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_THAT(harness.Get(id).reason(), HasSubstr("host beta is silent: regions "));
  beta.silent = false;
  harness.Run(seconds(1));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(harness.Get(id).reason(), "");
  EXPECT_EQ(harness.Workers(), 4u);
  ExpectNoIncarnationTwice(harness);
}

TEST(InstanceLifeTest, GivesUpAStartThatDoesNotCome) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 1);
  auto& beta = harness.AddHost("beta", 1);
  (void)alpha;
  const std::string id = Create(harness, TestPlan(2));
  beta.silent = true;  // attached, but nothing starts there; kept from being lost by its heartbeats
  for (int i = 0; i < 130; ++i) {
    harness.Run(milliseconds(500));
    harness.Send(beta, beta.fake.Heartbeat());
  }
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(harness.Get(id).reason(), HasSubstr("start timed out: not linked: region "));
  harness.Run(seconds(1));
  EXPECT_EQ(harness.agents["alpha"].fake.workers.size(), 0u);
}

TEST(InstanceLifeTest, DeleteEndsTheWorkersInOrder) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(4));
  harness.Pump();
  EXPECT_TRUE(harness.cluster().state().ContentInUse(SceneKey("0123")));
  Delete(harness, id);
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_STOPPING);
  harness.Pump();
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_ENDED);
  EXPECT_EQ(agent.fake.workers.size(), 0u);
  EXPECT_FALSE(harness.cluster().state().ContentInUse(SceneKey("0123")));
  EXPECT_TRUE(harness.store.List("scene/")->empty());
  Delete(harness, id);  // again: as it is
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_ENDED);
  harness.Run(std::chrono::hours(1) + seconds(1));
  EXPECT_EQ(GetInstance(harness.cluster().state(), id).status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(harness.store.List("instance/")->empty());
}

TEST(InstanceLifeTest, WorkersThatDoNotStopAreWithdrawnAfterAWhile) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(4));
  harness.Pump();
  agent.fake.stop_in_order = false;
  Delete(harness, id);
  harness.Run(seconds(9));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_STOPPING);
  EXPECT_EQ(agent.fake.workers.size(), 4u);
  harness.Run(seconds(3));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_ENDED);
  EXPECT_EQ(agent.fake.workers.size(), 0u);
}

TEST(InstanceLifeTest, AnInstanceOnALostHostCanBeDeletedAndTheHostRemoved) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(4));
  harness.Pump();
  v1::RemoveHostRequest remove;
  remove.set_name("alpha");
  const absl::Status refused = harness.cluster().RemoveHost(harness.now, remove);
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(refused.message(), "name: 4 regions run on host alpha, first inst-1; drain it first, or evict it by force");
  agent.silent = true;
  harness.Run(seconds(6));
  Delete(harness, id);
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_ENDED);
  agent.silent = false;
  harness.Pump();  // it was only cut off: what still runs there ends
  EXPECT_EQ(agent.fake.workers.size(), 0u);
  EXPECT_TRUE(harness.cluster().RemoveHost(harness.now, remove).ok());
}

TEST(InstanceLifeTest, ARestartLeavesARunningWorldAlone) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(4));
  harness.Pump();
  const auto before = agent.fake.workers;
  for (int i = 0; i < 3; ++i) {
    harness.Restart();
    EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
    EXPECT_EQ(harness.HostState("alpha"), v1::HOST_STATE_READY);
    harness.Run(seconds(7));
    EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  }
  ASSERT_EQ(agent.fake.workers.size(), 4u);
  for (const auto& [key, worker] : agent.fake.workers) {
    EXPECT_EQ(worker.report.identity().pid(), before.at(key).report.identity().pid());
    EXPECT_GT(worker.order.revision(), before.at(key).order.revision());
  }
}

// One whole story: create, join, run, leave, delete. The control plane dies before its n-th call, for every n.
TEST(InstanceLifeTest, AControlPlaneThatDiesAtAnyCallComesBackAndGoesOn) {
  int n = 0;
  for (bool died = true; died; ++n) {
    SCOPED_TRACE(n);
    ClusterHarness harness;
    harness.AddHost("alpha", 2);
    harness.AddHost("beta", 2);
    harness.calls_until_death = n;
    InstancePlan plan = TestPlan(4, 1);
    plan.request_id = "one";
    const std::string id = Create(harness, plan);
    harness.Run(seconds(2));
    const auto joined = harness.cluster().Join(harness.now, JoinRequest(id));
    ASSERT_TRUE(joined.ok()) << joined.status();
    harness.Run(seconds(2));
    ASSERT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness.Get(id).reason();
    ASSERT_EQ(harness.Workers(), 4u);
    v1::LeaveInstanceRequest leave;
    leave.set_instance_id(id);
    leave.set_credential(joined->response.credential());
    leave.set_credential_key(joined->response.credential_key());
    ASSERT_TRUE(harness.cluster().Leave(harness.now, leave).ok());
    harness.Run(seconds(1));
    EXPECT_EQ(harness.Get(id).players(), 0u);
    Delete(harness, id);
    harness.Run(seconds(2));
    ASSERT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_ENDED) << harness.Get(id).reason();
    ASSERT_EQ(harness.Workers(), 0u);
    ExpectNoIncarnationTwice(harness);
    died = harness.calls_until_death < 0;
  }
  EXPECT_GT(n, 50);
}

// Nothing goes out before it is stored, and the step is taken once it can be.
TEST(InstanceLifeTest, AStepThatCannotBeStoredIsTakenLater) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 4);
  const std::string id = Create(harness, TestPlan(2));
  harness.store.FailNext(1000);
  harness.Pump();
  harness.Attach(agent);  // and so gets its orders anew
  harness.Run(seconds(1));
  ASSERT_EQ(agent.fake.workers.size(), 2u);
  for (const auto& [key, worker] : agent.fake.workers) EXPECT_FALSE(worker.order.run());
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_STARTING);
  harness.store.FailNext(0);
  harness.Run(seconds(1));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
}

TEST(InstanceLifeTest, ReportsOfOtherWorkersAreIgnored) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  auto& beta = harness.AddHost("beta", 4);
  InstancePlan plan = TestPlan(1);
  const std::string id = Create(harness, plan);
  harness.Pump();
  v1::AgentMessage message;
  v1::WorkerIdentity& identity = *message.mutable_exited()->mutable_identity();
  for (const auto& [instance, region, incarnation] :
       {std::tuple(id, 1u, 1u), std::tuple(id, 0u, 1u), std::tuple(id, 77u, 1u), std::tuple(id, 1u, 9u),
        std::tuple(std::string("inst-99"), 1u, 1u), std::tuple(std::string("\x01"), 1u, 1u)}) {
    identity.set_instance_id(instance);
    identity.set_region(region);
    identity.set_incarnation(incarnation);
    harness.Send(beta, message);  // beta does not run it
  }
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
}

}  // namespace
}  // namespace tessera::control
