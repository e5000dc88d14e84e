// Scaling, draining, replacing and balancing a running world, under a virtual clock.
#include <gmock/gmock.h>

#include <algorithm>
#include <limits>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(ChangeTest, ScalesUpAndDownAgain) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  harness.AddHost("beta", 4);
  const std::string id = Start(harness, 2);
  ASSERT_TRUE(Scale(harness, id, 4).ok());
  harness.Run(seconds(5));
  ExpectSettled(harness, id, 4);
  ExpectEachBodyOnce(harness, 2);
  ASSERT_TRUE(Scale(harness, id, 4).ok());  // again: nothing
  const auto version = harness.Get(id).map().version();
  harness.Run(seconds(5));
  EXPECT_EQ(harness.Get(id).map().version(), version);
  ASSERT_TRUE(Scale(harness, id, 2).ok());
  harness.Run(seconds(5));
  ExpectSettled(harness, id, 2);
  ExpectEachBodyOnce(harness, 2);
}

// The agent's part of it is SupervisorTest.AnOrderKeepsTheOperationThatItBelongsTo, the worker's
// WorkerCoreTest.AnOrderIsLoggedWithItsOperation.
TEST(ChangeTest, OneIdIsInTheLogTheEventsAndTheOrdersOfAnOperation) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  const std::string id = Start(harness, 2);
  const std::string made = harness.Get(id).operation();
  EXPECT_NE(made, "");
  harness.cluster().TakeEffects();
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  const Effects effects = harness.cluster().TakeEffects();
  const std::string operation = harness.Get(id).operation();
  EXPECT_NE(operation, made);
  EXPECT_EQ(std::count_if(effects.log.begin(), effects.log.end(),
                          [&](const LogLine& line) {
                            return line.text == "event id=" + id + " op=" + operation + ": scaling from 2 to 3";
                          }),
            1);
  harness.Run(seconds(5));
  ExpectSettled(harness, id, 3);
  const v1::Instance world = harness.Get(id);
  EXPECT_EQ(world.operation(), operation) << "the maps that carry it out belong to it";
  EXPECT_EQ(world.events().rbegin()->operation(), operation) << world.events().rbegin()->text();
  for (const auto& [key, worker] : harness.agents.at("alpha").fake.workers) {
    EXPECT_EQ(worker.order.operation(), operation);
  }
}

// It was taken for one that had died, and its order was held back meanwhile.
TEST(ChangeTest, ANewcomerIsNotMissedInHeartbeatsThatLeftBeforeItsOrderCame) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 4);
  const std::string id = Start(harness, 2);
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  harness.cluster().HandleTimer(harness.now);
  ASSERT_EQ(harness.Get(id).region_status_size(), 3) << "it has a place";
  for (int i = 0; i < 10; ++i) harness.Send(alpha, alpha.fake.Heartbeat());
  harness.Run(seconds(5));
  ExpectSettled(harness, id, 3);
  const v1::Instance world = harness.Get(id);
  for (const v1::InstanceEvent& event : world.events()) {
    EXPECT_THAT(event.text(), testing::Not(testing::HasSubstr("ended")));
  }
  ExpectNoIncarnationTwice(harness);
}

// Clients refuse a grant whose regions are not those of its map.
TEST(ChangeTest, WhoJoinsMeanwhileIsToldTheRegionsOfTheMapInForce) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  const std::string id = Start(harness, 2);
  harness.agents.at("alpha").fake.unlinked = {3, 4};  // so the change is under way for a while
  ASSERT_TRUE(Scale(harness, id, 4).ok());
  harness.Run(seconds(1));
  ASSERT_EQ(harness.Get(id).region_status_size(), 4) << "the new workers are there";
  const auto joined = harness.cluster().Join(harness.now, JoinRequest(id, "ann"));
  ASSERT_TRUE(joined.ok()) << joined.status();
  const v1::JoinInstanceResponse& grant = joined->response;
  EXPECT_EQ(grant.map().regions_size(), 2);
  ASSERT_EQ(grant.regions_size(), grant.map().regions_size());
  for (int i = 0; i < grant.regions_size(); ++i) EXPECT_EQ(grant.regions(i).region(), grant.map().regions(i).id());
}

TEST(ChangeTest, ScalingWithoutRoomChangesNothing) {
  ClusterHarness harness;
  harness.AddHost("alpha", 2);
  const std::string id = Start(harness, 2);
  EXPECT_EQ(Scale(harness, id, 3, true).status().message(), "region 3 needs a place; no ready host has one free");
  EXPECT_EQ(Scale(harness, id, 3).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(harness.Get(id).wanted_regions(), 2u);
  EXPECT_EQ(Scale(harness, id, 0).status().message(), "regions: 0 is not in 1 to 1000");
  EXPECT_EQ(Scale(harness, "inst-9", 1).status().code(), absl::StatusCode::kNotFound);
}

TEST(ChangeTest, ADrainedHostIsEmptiedWithoutAHalt) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  auto& beta = harness.AddHost("beta", 4);
  harness.AddHost("gamma", 4);
  const std::string id = Start(harness, 4);
  const std::size_t there = beta.fake.workers.size();
  ASSERT_GT(there, 0u);
  v1::DrainHostRequest drain;
  drain.set_name("beta");
  ASSERT_TRUE(harness.cluster().DrainHost(drain).ok());
  for (int i = 0; i < 60; ++i) {
    harness.Run(milliseconds(250));
    EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  }
  EXPECT_TRUE(beta.fake.workers.empty());
  ExpectSettled(harness, id, 4);
  ExpectEachBodyOnce(harness, 4);
  v1::RemoveHostRequest remove;
  remove.set_name("beta");
  EXPECT_TRUE(harness.cluster().RemoveHost(harness.now, remove).ok());
}

TEST(ChangeTest, AHostThatComesBackGetsItsShareAgain) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 8);
  auto& beta = harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  ASSERT_EQ(alpha.fake.workers.size(), 2u);
  v1::DrainHostRequest drain;
  drain.set_name("beta");
  ASSERT_TRUE(harness.cluster().DrainHost(drain).ok());
  harness.Run(seconds(15));
  ASSERT_EQ(alpha.fake.workers.size(), 4u);
  drain.set_undo(true);
  ASSERT_TRUE(harness.cluster().DrainHost(drain).ok());
  harness.Run(seconds(15));
  EXPECT_EQ(alpha.fake.workers.size(), 2u);
  EXPECT_EQ(beta.fake.workers.size(), 2u);
  ExpectSettled(harness, id, 4);
  ExpectEachBodyOnce(harness, 4);
  const auto version = harness.Get(id).map().version();
  harness.Run(seconds(5));
  EXPECT_EQ(harness.Get(id).map().version(), version) << "then it stays";
}

TEST(ChangeTest, WorkersAreReplacedOneAfterTheOther) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 8);
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  std::set<std::int64_t> before;
  for (const auto& [name, agent] : harness.agents) {
    for (const auto& [key, worker] : agent.fake.workers)
      before.insert(worker.report.identity().pid() * 100 + (&agent == &alpha));
  }
  v1::RestartWorkersRequest request;
  request.set_id(id);
  ASSERT_TRUE(harness.cluster().RestartWorkers(harness.now, request).ok());
  std::size_t most = 0;
  for (int i = 0; i < 100; ++i) {
    harness.Run(milliseconds(250));
    most = std::max(most, harness.Workers());
  }
  EXPECT_LE(most, 5u);
  ExpectSettled(harness, id, 4);
  ExpectEachBodyOnce(harness, 4);
  for (const auto& [name, agent] : harness.agents) {
    for (const auto& [key, worker] : agent.fake.workers) {
      EXPECT_FALSE(before.contains(worker.report.identity().pid() * 100 + (&agent == &alpha)));
    }
  }
}

// Nor is it kept in mind, so what would make room is not forbidden.
TEST(ChangeTest, ReplacingWithoutRoomIsRefused) {
  ClusterHarness harness;
  harness.AddHost("alpha", 2);
  harness.AddHost("beta", 2);
  const std::string id = Start(harness, 4);
  v1::RestartWorkersRequest request;
  request.set_id(id);
  EXPECT_EQ(harness.cluster().RestartWorkers(harness.now, request).status().code(),
            absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  harness.Run(seconds(10));
  ExpectSettled(harness, id, 3);
  EXPECT_TRUE(harness.cluster().RestartWorkers(harness.now, request).ok());
  harness.Run(seconds(20));
  ExpectSettled(harness, id, 3);
  ExpectEachBodyOnce(harness, 4);
}

// A drained host's workers lack a place as well; with fewer regions there is one.
TEST(ChangeTest, WhatMakesRoomForADrainedHostIsDone) {
  ClusterHarness harness;
  harness.AddHost("alpha", 2);
  auto& beta = harness.AddHost("beta", 2);
  const std::string id = Start(harness, 4);
  v1::DrainHostRequest drain;
  drain.set_name("beta");
  ASSERT_TRUE(harness.cluster().DrainHost(drain).ok());
  ASSERT_TRUE(Scale(harness, id, 2).ok());
  harness.Run(seconds(30));
  EXPECT_TRUE(beta.fake.workers.empty());
  ExpectSettled(harness, id, 2);
  ExpectEachBodyOnce(harness, 4);
}

TEST(ChangeTest, APlanThatIsRefusedByAllIsPutOffUnderANewVersion) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  const std::string id = Start(harness, 1);
  harness.agents["alpha"].fake.refuse_plans = {2};
  ASSERT_TRUE(Scale(harness, id, 2).ok());
  harness.Run(seconds(6));
  ExpectSettled(harness, id, 2);
  EXPECT_GT(harness.Get(id).map().version(), 3u);
}

TEST(ChangeTest, ANewcomerThatDiesTakesThePlanWithItAndAnotherIsTried) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 8);
  const std::string id = Start(harness, 2);
  alpha.fake.exit_at_start = {3};
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  harness.Run(seconds(2));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  ExpectSettled(harness, id, 2);
  alpha.fake.exit_at_start = {};
  harness.Run(seconds(10));
  ExpectSettled(harness, id, 3);
  ExpectEachBodyOnce(harness, 2);
}

TEST(ChangeTest, NothingIsPlacedOnAHostThatHasJustDied) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 8);
  auto& beta = harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  beta.fake.workers.clear();
  beta.silent = true;
  harness.Run(milliseconds(4500));  // it is not lost yet
  EXPECT_EQ(harness.Get(id).failovers(), 1u);
  EXPECT_EQ(alpha.fake.workers.size(), 4u) << harness.Get(id).DebugString();
  ExpectSettled(harness, id, 4);
  ExpectEachBodyOnce(harness, 4);
}

TEST(ChangeTest, ANewcomerWhoseHostDiesBeforeItStartsIsWaitedForNoLonger) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 8);
  const std::string id = Start(harness, 2);
  auto& beta = harness.AddHost("beta", 8);  // has fewest of this world: what is new goes there
  beta.silent = true;
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  ASSERT_FALSE(harness.Get(id).changes().empty());
  ASSERT_EQ(alpha.fake.workers.size(), 2u);
  harness.Run(seconds(10));
  ExpectSettled(harness, id, 3);
  EXPECT_EQ(alpha.fake.workers.size(), 3u);
  ExpectEachBodyOnce(harness, 2);
}

TEST(ChangeTest, ANewcomerThatItsNeighboursRefuseTakesNothingOver) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 2);
  for (auto& [name, agent] : harness.agents) agent.fake.unlinked = {3};
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  harness.Run(seconds(40));
  v1::Instance world = harness.Get(id);
  EXPECT_EQ(world.state(), v1::INSTANCE_STATE_RUNNING) << world.reason();
  EXPECT_EQ(world.map().version(), 1u);
  EXPECT_EQ(harness.Workers(), 2u);
  ExpectEachBodyOnce(harness, 2);
  ASSERT_EQ(world.changes_size(), 1);
  EXPECT_THAT(world.changes(0).text(), testing::HasSubstr("taken back"));
  EXPECT_THAT(world.changes(0).text(), testing::HasSubstr("has no link to region"));
  for (auto& [name, agent] : harness.agents) agent.fake.unlinked = {};
  harness.Run(seconds(70));
  ExpectSettled(harness, id, 3);
  ExpectEachBodyOnce(harness, 2);
}

TEST(ChangeTest, ANewcomerHasAStandbyBeforeItsMapIsInForce) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 8);
  auto& beta = harness.AddHost("beta", 8);
  const std::string id = Start(harness, 2);
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  harness.Exchange();
  auto& home = harness.AgentOf(id, 3);
  const v1::WorkerOrder& order = home.fake.workers.at({id, 3}).order;
  ASSERT_TRUE(order.joins_running());
  ASSERT_NE(order.standby(), 0U);
  EXPECT_EQ(harness.Get(id).map().version(), 1U);
  auto& standbys = harness.AgentOf(id, order.standby());
  EXPECT_NE(&standbys, &home);
  EXPECT_TRUE(&standbys == &alpha || &standbys == &beta);
  const auto& primaries = standbys.fake.workers.at({id, order.standby()}).order.primaries();
  EXPECT_EQ(std::count(primaries.begin(), primaries.end(), 3U), 1);
}

TEST(ChangeTest, TwoThatJoinTogetherAreNotEachOthersStandbys) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 2);
  ASSERT_TRUE(Scale(harness, id, 4).ok());
  harness.Exchange();
  for (const std::uint32_t newcomer : {3U, 4U}) {
    const v1::WorkerOrder& order = harness.AgentOf(id, newcomer).fake.workers.at({id, newcomer}).order;
    ASSERT_TRUE(order.joins_running());
    EXPECT_THAT(order.standby(), testing::AnyOf(1U, 2U)) << newcomer;
  }
}

// It runs, its standby as well, and the two do not hear each other.
void SetUnprotected(ClusterHarness& harness, const std::string& id, std::uint32_t region, bool unprotected) {
  v1::WorkerReport& report = harness.AgentOf(id, region).fake.workers.at({id, region}).report;
  report.set_unprotected(unprotected);
}

TEST(ChangeTest, ARegionWhoseStandbyTakesNothingIsGivenAnother) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  const std::uint32_t first = StandbyOf(harness.Get(id), 1);
  ASSERT_NE(first, 0U);
  SetUnprotected(harness, id, 1, true);
  harness.Run(seconds(3));
  EXPECT_EQ(StandbyOf(harness.Get(id), 1), first) << "it may only be slow";
  harness.Run(seconds(4));
  SetUnprotected(harness, id, 1, false);
  harness.Run(seconds(2));
  const std::uint32_t second = StandbyOf(harness.Get(id), 1);
  EXPECT_NE(second, first);
  EXPECT_NE(&harness.AgentOf(id, second), &harness.AgentOf(id, 1)) << "on another host, while there is one";
  ExpectSettled(harness, id, 4);
  ExpectEachBodyOnce(harness, 4);
  const std::uint64_t version = harness.Get(id).map().version();
  harness.Run(seconds(30));
  EXPECT_EQ(harness.Get(id).map().version(), version) << "and stays with it";
}

TEST(ChangeTest, ARegionWithoutAnotherStandbyKeepsItsOwnAndAChangeSaysWhomItWaitsFor) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  harness.AddHost("beta", 4);
  const std::string id = Start(harness, 2);
  SetUnprotected(harness, id, 1, true);
  harness.Run(seconds(12));
  EXPECT_EQ(harness.Get(id).map().version(), 1U);
  ASSERT_TRUE(Scale(harness, id, 1).ok());
  harness.AgentOf(id, 2).fake.workers.at({id, 2}).report.set_bodies_outside(7);
  harness.Run(seconds(3));
  const v1::Instance instance = harness.Get(id);
  ASSERT_EQ(instance.changes_size(), 1);
  EXPECT_THAT(instance.changes(0).text(), testing::HasSubstr("region 2 has 7 to hand over"));
  EXPECT_THAT(instance.changes(0).text(), testing::HasSubstr("region 1 is unprotected and acknowledges nothing"));
}

TEST(ChangeTest, ADeathAmidAChangeIsCarriedOnAndTheChangeDone) {
  for (int step = 0; step < 12; ++step) {
    SCOPED_TRACE(step);
    ClusterHarness harness;
    harness.AddHost("alpha", 8);
    harness.AddHost("beta", 8);
    const std::string id = Start(harness, 3);
    ASSERT_TRUE(Scale(harness, id, 4).ok());
    for (int i = 0; i < step; ++i) harness.Exchange();
    auto& agent = harness.AgentOf(id, 2);
    harness.Send(agent, agent.fake.Kill({id, 2}, 9));
    harness.Run(seconds(15));
    ExpectSettled(harness, id, 4);
    ExpectEachBodyOnce(harness, 3);
  }
}

TEST(ChangeTest, ABusyRegionGivesGroundAndNoiseMovesNothing) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 8);
  const std::string id = Start(harness, 2, true);
  const auto set_loads = [&](double first, double second) {
    for (auto& [key, worker] : alpha.fake.workers) {
      worker.report.mutable_step()->set_p50_seconds(key.second == 1 ? first : second);
    }
  };
  set_loads(0.0021, 0.002);
  harness.Run(seconds(5));
  EXPECT_EQ(harness.Get(id).map().version(), 1u);
  EXPECT_NEAR(harness.Get(id).imbalance(), 1.024, 1e-3);
  set_loads(0.008, 0.002);
  harness.Run(milliseconds(1500));
  set_loads(0.002, 0.002);
  harness.Run(seconds(5));
  const v1::PartitionMap map = harness.Get(id).map();
  EXPECT_GT(map.version(), 1u);
  double first = 0;
  for (const v1::Cell& cell : map.cells()) {
    if (cell.owner() == 1)
      first += (cell.area().max_x() - cell.area().min_x()) * (cell.area().max_z() - cell.area().min_z());
  }
  EXPECT_LT(first, 4000);  // it had 5000 of 10000 before
}

// The share of its area that region 1 has left after the first move, if it takes four times as long as the other. All
// bodies lie so far into their region's cell, in shares of its extent, along both axes.
double LeftAfterOneMove(double from, double to) {
  ClusterHarness harness;
  auto& alpha = harness.AddHost("alpha", 8);
  const std::string id = Start(harness, 2, true);
  const auto area_of_first = [&](const v1::PartitionMap& map) {
    double area = 0;
    for (const v1::Cell& cell : map.cells()) {
      if (cell.owner() != 1) continue;
      area += (cell.area().max_x() - cell.area().min_x()) * (cell.area().max_z() - cell.area().min_z());
    }
    return area;
  };
  const v1::PartitionMap before = harness.Get(id).map();
  for (auto& [key, worker] : alpha.fake.workers) {
    const std::uint32_t region = key.second;
    const auto cell = std::find_if(before.cells().begin(), before.cells().end(),
                                   [&](const v1::Cell& c) { return c.owner() == region; });
    const auto& area = cell->area();
    for (const double share : {from, to}) {
      worker.report.add_spread_x(static_cast<float>(area.min_x() + share * (area.max_x() - area.min_x())));
      worker.report.add_spread_z(static_cast<float>(area.min_z() + share * (area.max_z() - area.min_z())));
    }
    worker.report.mutable_step()->set_p50_seconds(region == 1 ? 0.008 : 0.002);
  }
  for (int i = 0; i < 50 && harness.Get(id).map().version() == before.version(); ++i) harness.Run(milliseconds(100));
  EXPECT_GT(harness.Get(id).map().version(), before.version());
  return area_of_first(harness.Get(id).map()) / area_of_first(before);
}

TEST(ChangeTest, ABorderGoesToWhereTheReportedBodiesLie) {
  // Five eighths of the region's load are to stay.
  EXPECT_NEAR(LeftAfterOneMove(0, 1), 0.625, 1e-3);
  EXPECT_NEAR(LeftAfterOneMove(0.4, 1), 0.4 + 0.6 * 0.625, 1e-3);
  EXPECT_NEAR(LeftAfterOneMove(0.9, 1), 0.9 + 0.1 * 0.625, 1e-3);
}

TEST(ChangeTest, ReportedPositionsThatAreNoneAreTakenForNotKnown) {
  EXPECT_NEAR(LeftAfterOneMove(1, 0.9), 0.625, 1e-3);  // descending
  EXPECT_NEAR(LeftAfterOneMove(0, std::numeric_limits<double>::quiet_NaN()), 0.625, 1e-3);
  EXPECT_NEAR(LeftAfterOneMove(0, std::numeric_limits<double>::infinity()), 0.625, 1e-3);
}

// A scaling. The control plane dies before its n-th call, for every n.
TEST(ChangeTest, AControlPlaneThatDiesAtAnyCallBringsAChangeToItsEnd) {
  int n = 0;
  for (bool died = true; died && n <= 120; ++n) {
    SCOPED_TRACE(n);
    ClusterHarness harness;
    harness.AddHost("alpha", 4);
    harness.AddHost("beta", 4);
    const std::string id = Start(harness, 2);
    ASSERT_TRUE(Scale(harness, id, 3).ok());
    harness.calls_until_death = n;
    harness.Run(seconds(8));
    ExpectSettled(harness, id, 3);
    ExpectEachBodyOnce(harness, 2);
    died = harness.calls_until_death < 0;
  }
}

}  // namespace
}  // namespace tessera::control
