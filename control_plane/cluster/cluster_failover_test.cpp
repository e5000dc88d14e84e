// Workers that die while their world runs, under a virtual clock: what is carried on, by whom, and when.
#include <gmock/gmock.h>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

// Time passes in quarter seconds; what the agent's workers hold of their primaries grows with it.
void RunWhileCopiesGrow(ClusterHarness& harness, FakeHost& agent, int quarters) {
  for (int i = 0; i < quarters; ++i) {
    for (auto& [key, worker] : agent.fake.workers) {
      for (v1::StandbyStatus& standby_copy : *worker.report.mutable_standby_copies())
        standby_copy.set_tick(standby_copy.tick() + 15);
    }
    harness.Run(milliseconds(250));
  }
}

bool Joined(const std::vector<v1::InstanceEvent>& events, const std::string& text) {
  return std::any_of(events.begin(), events.end(),
                     [&](const v1::InstanceEvent& event) { return event.text().find(text) != std::string::npos; });
}
std::vector<v1::InstanceEvent> Events(const v1::Instance& instance) {
  return {instance.events().begin(), instance.events().end()};
}

TEST(FailoverTest, TheStandbyCarriesADeadRegionOnAndItIsReplaced) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  const std::uint32_t standby = StandbyOf(harness.Get(id), 2);
  ASSERT_NE(&harness.AgentOf(id, 2), &harness.AgentOf(id, standby));
  auto& agent = harness.AgentOf(id, 2);
  harness.Send(agent, agent.fake.Kill({id, 2}, 9));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_EQ(harness.Get(id).map().regions_size(), 3);
  EXPECT_EQ(harness.Workers(), 3u);
  harness.Pump();  // no time passes: the exit was seen
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(harness.Get(id).failovers(), 1u);
  ExpectEachBodyOnce(harness, 4);
  EXPECT_TRUE(Joined(Events(harness.Get(id)), "region 2 on")) << harness.Get(id).DebugString();
  EXPECT_TRUE(Joined(Events(harness.Get(id)), "3 bodies promoted, 0 lost"));
  harness.Run(seconds(10));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(harness.Get(id).map().regions_size(), 4);  // a new worker has a part of the world again
  EXPECT_EQ(harness.Workers(), 4u);
  ExpectEachBodyOnce(harness, 4);
  ExpectNoIncarnationTwice(harness);
}

// One of the scene's bodies is held by nobody, one was taken out for good reason before.
TEST(FailoverTest, CountsABodyThatNobodyHoldsOnce) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  InstancePlan plan = TestPlan(3);
  for (const std::uint64_t id : {7, 8, 1001, 1002, 1003, 2001, 2002, 2003, 3001, 3002, 3003})
    plan.bodies.emplace_back(id);
  const auto made = harness.cluster().CreateInstance(harness.now, plan, false);
  ASSERT_TRUE(made.ok()) << made.status();
  const std::string id = made->id();
  harness.Run(seconds(1));
  agent.fake.workers.at({id, 1}).report.add_nonfinite_ids(8);
  harness.Run(seconds(1));
  harness.Send(agent, agent.fake.Kill({id, 2}, 9));
  harness.Pump();
  EXPECT_TRUE(Joined(Events(harness.Get(id)), "3 bodies promoted, 1 lost")) << harness.Get(id).DebugString();
  EXPECT_EQ(harness.Get(id).lost_bodies(), 1u);
  EXPECT_TRUE(harness.Get(id).has_lost_time());
  harness.Restart();
  harness.Run(seconds(10));
  harness.Send(agent, agent.fake.Kill({id, 1}, 9));
  harness.Run(seconds(1));
  EXPECT_EQ(harness.Get(id).failovers(), 2u);
  EXPECT_EQ(harness.Get(id).lost_bodies(), 1u);
}

TEST(FailoverTest, WhoHasThePlaceMakesThePlayersThatTheDeadHadNotMade) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Start(harness, 4);
  v1::JoinInstanceRequest join;
  join.set_instance_id(id);
  for (int player = 0; player < 2; ++player) ASSERT_TRUE(harness.cluster().Join(harness.now, join).ok());
  harness.Pump();
  const std::uint32_t standby = StandbyOf(harness.Get(id), 1);
  const std::uint64_t made = PlayerBodyId(PlayerNumber(2)).value();  // by region 4, and gone over to region 1 since
  harness.world->owned[agent.fake.workers.at({id, 1}).report.identity().incarnation()][made] = 2;
  harness.Send(agent, agent.fake.Kill({id, 1}, 9));
  harness.Pump();
  const v1::WorkerOrder& order = agent.fake.workers.at({id, standby}).order;
  ASSERT_EQ(order.players_size(), 2);
  EXPECT_EQ(order.players(0).spawn_region(), standby);  // had no body yet
  EXPECT_EQ(order.players(1).spawn_region(), 4u);
}

TEST(FailoverTest, ASilentHostIsCarriedOnByTheOtherOnceItsLeasesHaveRunOut) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  auto& beta = harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  const std::size_t there = beta.fake.workers.size();
  ASSERT_EQ(there, 2u);
  beta.silent = true;
  harness.Run(milliseconds(1000));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  harness.Run(milliseconds(500));  // begun; the standbys have only just stopped to acknowledge
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_EQ(harness.Get(id).failovers(), 0u);
  harness.Run(milliseconds(1250));
  EXPECT_EQ(harness.Get(id).failovers(), 1u);
  // Cut off, and back: what ran there is fenced and ends, and nothing is started twice.
  beta.silent = false;
  harness.Run(seconds(10));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(harness.Workers(), 4u);
  ExpectEachBodyOnce(harness, 4);
  ExpectNoIncarnationTwice(harness);
}

// Whoever is heard first once the network is back proves nothing about those who are not heard yet.
TEST(FailoverTest, AControlPlaneThatWasCutOffDeclaresNobodyDeadForIt) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 4);
  auto& beta = harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  alpha.silent = beta.silent = true;
  harness.Run(seconds(3));
  alpha.silent = false;
  harness.Run(milliseconds(750));
  EXPECT_FALSE(harness.cluster().state().FindInstance(id)->record.has_failover()) << "beta is to be heard yet";
  beta.silent = false;
  harness.Run(seconds(5));
  EXPECT_EQ(harness.Get(id).failovers(), 0u);

  // One that stays away is carried on, as ever.
  alpha.silent = beta.silent = true;
  harness.Run(seconds(3));
  alpha.silent = false;
  harness.Run(seconds(5));
  EXPECT_EQ(harness.Get(id).failovers(), 1u);
}

TEST(FailoverTest, NobodyWaitsForALeaseThatRanOutLongAgo) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 4);
  auto& beta = harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  alpha.fake.last_acknowledged_ms = 1500;
  beta.silent = true;
  harness.Run(milliseconds(1500));
  EXPECT_EQ(harness.Get(id).failovers(), 1u);
}

TEST(FailoverTest, AStandbyWhoseCopyGrowsIsAWitnessThatTheRegionLives) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 4);
  auto& beta = harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  beta.silent = true;  // its agent is away; its workers are not
  RunWhileCopiesGrow(harness, alpha, 40);
  EXPECT_EQ(harness.Get(id).failovers(), 0u);
  EXPECT_EQ(harness.Get(id).map().version(), 1u);
  EXPECT_THAT(harness.Get(id).reason(), HasSubstr("host beta is silent"));
}

TEST(FailoverTest, OfTwoHostsThatFallSilentTogetherNeitherIsDeclaredDeadBeforeOneIsHeard) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 4);
  auto& beta = harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  beta.silent = true;  // its agent is away; its workers are not
  RunWhileCopiesGrow(harness, alpha, 8);
  harness.Run(milliseconds(250));  // alpha's last word has nothing new of beta
  alpha.silent = true;
  harness.Run(seconds(5));
  EXPECT_EQ(harness.Get(id).map().version(), 1u);
  beta.silent = false;
  harness.Run(seconds(5));
  EXPECT_EQ(harness.Get(id).failovers(), 1u);
  const v1::Instance now = harness.Get(id);
  for (const auto& worker : beta.fake.workers) {
    const std::uint32_t region = worker.first.second;
    EXPECT_TRUE(std::any_of(now.map().regions().begin(), now.map().regions().end(),
                            [region](const v1::MapRegion& in_map) { return in_map.id() == region; }));
  }
  ExpectNoIncarnationTwice(harness);
}

// No death is known, and none is made up: where nobody hears them both may run on.
TEST(FailoverTest, TwoHostsThatStaySilentAreWaitedForByNameUntilSomebodySaysThatTheyAreGone) {
  ControlSettings settings;
  settings.silence_patience = seconds(20);
  ClusterHarness harness(settings);
  auto& alpha = harness.AddHost("alpha", 4);
  auto& beta = harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  alpha.silent = beta.silent = true;
  harness.Run(seconds(120));
  const v1::Instance waiting = harness.Get(id);
  EXPECT_EQ(waiting.state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_EQ(waiting.map().version(), 1u);
  EXPECT_THAT(waiting.reason(), HasSubstr("waits for host alpha, silent since "));
  EXPECT_THAT(waiting.reason(), HasSubstr("waits for host beta, silent since "));
  EXPECT_THAT(waiting.reason(), HasSubstr("tessera host remove HOST --force"));
  EXPECT_TRUE(Joined(Events(waiting), "waits for host alpha, silent since "));
  alpha.silent = beta.silent = false;
  harness.Run(seconds(5));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness.Get(id).reason();
  EXPECT_EQ(harness.Get(id).failovers(), 0u);
  ExpectEachBodyOnce(harness, 4);

  alpha.silent = beta.silent = true;
  harness.Run(seconds(30));
  for (const char* name : {"alpha", "beta"}) {
    ASSERT_NE(harness.Get(id).state(), v1::INSTANCE_STATE_FAILED) << harness.Get(id).reason();
    v1::RemoveHostRequest remove;
    remove.set_name(name);
    remove.set_force(true);
    ASSERT_TRUE(harness.cluster().RemoveHost(harness.now, remove).ok());
  }
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_FAILED) << "it has no checkpoint";
}

TEST(FailoverTest, AControlPlaneThatStoodStillBlamesNobody) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  harness.Run(seconds(1));
  harness.now.steady += seconds(30);
  harness.cluster().HandleTimer(harness.now);
  harness.Run(seconds(1));
  EXPECT_EQ(harness.Get(id).map().version(), 1u);
  EXPECT_EQ(harness.HostState("alpha"), v1::HOST_STATE_READY);
}

TEST(FailoverTest, ARegionAndItsStandbyLostTogetherAreNoSuccess) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  const std::uint32_t standby = StandbyOf(harness.Get(id), 1);
  auto& first = harness.AgentOf(id, 1);
  auto& second = harness.AgentOf(id, standby);
  harness.Send(first, first.fake.Kill({id, 1}, 9));
  harness.Send(second, second.fake.Kill({id, standby}, 9));
  harness.Pump();
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(harness.Get(id).reason(), HasSubstr("lost together with its standby"));
}

// Alpha loses a region whose standby is on beta, whose agent falls silent at that moment.
struct SilentStandby {
  explicit SilentStandby(ControlSettings settings = {}) : harness(settings) {
    harness.AddHost("alpha", 8);
    beta = &harness.AddHost("beta", 8);
    id = Start(harness, 4);
    auto& agent = harness.agents.at("alpha");
    for (const auto& [key, worker] : agent.fake.workers) {
      if (beta->fake.workers.contains({id, StandbyOf(harness.Get(id), key.second)})) region = key.second;
    }
    EXPECT_NE(region, 0U);
    beta->silent = true;
    harness.Send(agent, agent.fake.Kill({id, region}, 9));
  }
  ClusterHarness harness;
  FakeHost* beta = nullptr;
  std::string id;
  std::uint32_t region = 0;
};

TEST(FailoverTest, AWorldWaitsForTheSilentHostOfAStandbyAndSaysSo) {
  SilentStandby run;
  run.harness.Run(seconds(60));
  const v1::Instance waiting = run.harness.Get(run.id);
  EXPECT_EQ(waiting.state(), v1::INSTANCE_STATE_DEGRADED) << waiting.reason();
  EXPECT_THAT(waiting.reason(), HasSubstr("waits for host beta, silent since "));
  ASSERT_EQ(waiting.changes_size(), 1);
  EXPECT_THAT(waiting.changes(0).text(), HasSubstr("; waits for host beta, silent since "));
  EXPECT_TRUE(Joined(Events(waiting), "waits for host beta, silent since "));
  run.beta->silent = false;
  run.harness.Run(seconds(20));
  const v1::Instance now = run.harness.Get(run.id);
  EXPECT_EQ(now.state(), v1::INSTANCE_STATE_RUNNING) << now.reason();
  EXPECT_EQ(now.lost_bodies(), 0U);
  EXPECT_EQ(run.harness.Workers(), 4U);
  ExpectEachBodyOnce(run.harness, 4);
  ExpectNoIncarnationTwice(run.harness);
}

TEST(FailoverTest, AControlPlaneThatBeginsWhileAWorldWaitsGivesItUpNoSooner) {
  SilentStandby run;
  run.harness.Run(seconds(5));
  run.harness.Restart();
  run.harness.Run(seconds(60));
  EXPECT_EQ(run.harness.Get(run.id).state(), v1::INSTANCE_STATE_DEGRADED) << run.harness.Get(run.id).reason();
  run.beta->silent = false;
  run.harness.Run(seconds(20));
  EXPECT_EQ(run.harness.Get(run.id).state(), v1::INSTANCE_STATE_RUNNING) << run.harness.Get(run.id).reason();
  ExpectEachBodyOnce(run.harness, 4);
}

TEST(FailoverTest, AWorldThatWaitsIsLostOnceTheHostIsEvictedOrThePatienceIsOver) {
  for (const bool evicted : {true, false}) {
    SCOPED_TRACE(evicted);
    ControlSettings settings;
    settings.silence_patience = seconds(20);
    SilentStandby run(settings);
    run.harness.Run(seconds(18));
    ASSERT_EQ(run.harness.Get(run.id).state(), v1::INSTANCE_STATE_DEGRADED) << run.harness.Get(run.id).reason();
    v1::RemoveHostRequest remove;
    remove.set_name("beta");
    remove.set_force(true);
    if (evicted) {
      ASSERT_TRUE(run.harness.cluster().RemoveHost(run.harness.now, remove).ok());
    } else {
      run.harness.Run(seconds(5));
    }
    EXPECT_EQ(run.harness.Get(run.id).state(), v1::INSTANCE_STATE_FAILED) << run.harness.Get(run.id).reason();
  }
}

TEST(FailoverTest, AnotherDeathOnTheWayBeginsAnewWithTheDeadOfBoth) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  harness.AddHost("beta", 8);
  harness.AddHost("gamma", 8);
  const std::string id = Start(harness, 9);
  const std::uint32_t standby = StandbyOf(harness.Get(id), 1);
  std::uint32_t other = 2;
  while (other == standby || StandbyOf(harness.Get(id), other) == 1 || StandbyOf(harness.Get(id), standby) == other)
    ++other;
  for (const std::uint32_t region : {1u, other}) {
    auto& agent = harness.AgentOf(id, region);
    harness.Send(agent, agent.fake.Kill({id, region}, 9));
  }
  const auto version = harness.Get(id).map().version();
  EXPECT_EQ(version, 3u);
  harness.Pump();
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness.Get(id).reason();
  EXPECT_EQ(harness.Get(id).failovers(), 1u);
  ExpectEachBodyOnce(harness, 9);
}

// The resolution is made, or stored as well, and its standby has not heard of it.
TEST(FailoverTest, ADeathBeforeAResolutionIsCarriedOutLosesNothingOfTheFirst) {
  for (const bool stored : {false, true}) {
    SCOPED_TRACE(stored);
    ClusterHarness harness;
    for (const char* name : {"alpha", "beta", "gamma"}) harness.AddHost(name, 8);
    const std::string id = Start(harness, 9);
    const std::uint32_t standby = StandbyOf(harness.Get(id), 1);
    std::uint32_t other = 2;
    while (other == standby || StandbyOf(harness.Get(id), other) == 1) ++other;
    auto& first = harness.AgentOf(id, 1);
    harness.Send(first, first.fake.Kill({id, 1}, 9));
    harness.Exchange();
    ASSERT_TRUE(harness.cluster().state().FindInstance(id)->told);
    if (stored) {  // which does not wait for agents that take no orders
      harness.now.steady += milliseconds(500);
      harness.cluster().HandleTimer(harness.now);
    }
    ASSERT_EQ(harness.Get(id).failovers(), stored ? 1u : 0u);
    auto& second = harness.AgentOf(id, other);
    harness.Send(second, second.fake.Kill({id, other}, 9));
    harness.Pump();
    EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness.Get(id).reason();
    EXPECT_EQ(harness.Get(id).lost_bodies(), 0u);
    EXPECT_EQ(harness.Get(id).failovers(), 2u);
    ExpectEachBodyOnce(harness, 9);
  }
}

TEST(FailoverTest, IsGivenUpWhenALivingRegionDoesNotAnswer) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  auto& agent = harness.AgentOf(id, 2);
  for (auto& [name, living] : harness.agents) living.fake.mute = true;
  harness.Send(agent, agent.fake.Kill({id, 2}, 9));
  harness.Run(seconds(14));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
  harness.Run(seconds(2));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(harness.Get(id).reason(), HasSubstr("timed out waiting for the inventories of regions "));
}

TEST(FailoverTest, AnEarlierFailoversAnswersAreNotTaken) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  auto& agent = harness.AgentOf(id, 2);
  harness.Send(agent, agent.fake.Kill({id, 2}, 9));
  v1::AgentMessage stale;
  for (auto& [name, living] : harness.agents) {
    for (auto& [key, worker] : living.fake.workers) {
      *stale.mutable_inventory()->mutable_identity() = worker.report.identity();
      stale.mutable_inventory()->mutable_inventory()->set_version(1);
      stale.mutable_inventory()->mutable_inventory()->set_region(key.second);
      harness.Send(living, stale);
      stale.mutable_inventory()->mutable_inventory()->set_version(2);
      stale.mutable_inventory()->mutable_inventory()->set_region(77);  // and one that is wrong
      harness.Send(living, stale);
    }
  }
  EXPECT_EQ(harness.Get(id).failovers(), 0u);
  harness.Pump();
  EXPECT_EQ(harness.Get(id).failovers(), 1u);
  ExpectEachBodyOnce(harness, 4);
}

// Death, takeover and replacement. The control plane dies before its n-th call, for every n: between storing and
// sending each map and each resolution, and between sending and hearing.
TEST(FailoverTest, AControlPlaneThatDiesAtAnyCallBringsItToAnEnd) {
  int n = 0;
  for (bool died = true; died; ++n) {
    SCOPED_TRACE(n);
    ClusterHarness harness;
    harness.AddHost("alpha", 4);
    harness.AddHost("beta", 4);
    const std::string id = Start(harness, 4);
    auto& agent = harness.AgentOf(id, 3);
    const v1::AgentMessage exited = agent.fake.Kill({id, 3}, 9);
    harness.calls_until_death = n;
    harness.Send(agent, exited);
    harness.Run(seconds(12));
    ASSERT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness.Get(id).reason();
    ASSERT_EQ(harness.Get(id).failovers(), 1u);
    ASSERT_EQ(harness.Get(id).map().regions_size(), 4);
    ASSERT_EQ(harness.Workers(), 4u);
    ExpectEachBodyOnce(harness, 4);
    ExpectNoIncarnationTwice(harness);
    died = harness.calls_until_death < 0;
    if (n > 150) break;  // the rest is peace
  }
  EXPECT_GT(n, 100);
}

TEST(LeaseTest, IsRenewedForWhoIsToRunAndForNobodyElse) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 4);
  harness.AddHost("beta", 4);
  const std::string id = Start(harness, 2);
  auto& home = harness.AgentOf(id, 1);
  (void)agent;
  harness.cluster().TakeEffects();
  v1::AgentMessage message;
  *message.mutable_lease()->mutable_identity() = home.fake.workers.at({id, 1}).report.identity();
  message.mutable_lease()->set_number(42);
  harness.Send(home, message);
  Effects effects = harness.cluster().TakeEffects();
  ASSERT_EQ(effects.leases.size(), 1u);
  EXPECT_EQ(effects.leases[0].second.number(), 42u);
  EXPECT_EQ(effects.leases[0].second.ttl_ms(), 1000u);
  message.mutable_lease()->mutable_identity()->set_incarnation(99);  // an earlier or unknown life
  harness.Send(home, message);
  EXPECT_TRUE(harness.cluster().TakeEffects().leases.empty());
}

}  // namespace
}  // namespace tessera::control
