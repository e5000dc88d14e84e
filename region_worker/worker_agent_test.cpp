// The real program under an agent that is the test: orders, reports, the agent away and back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <map>

#include "core/region/census.h"
#include "net/protocol.h"
#include "region_worker/testing/agented_workers.h"
#include "region_worker/testing/test_client.h"

namespace tessera::worker {
namespace {

constexpr char kInstance[] = "inst-3";
constexpr char kScene[] = R"(
  name: "halves"
  bounds { min { x: -10 y: -2 z: -10 } max { x: 10 y: 10 z: 10 } }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  scatters {
    first_id: 100 count: 30
    area { min { x: -8 y: 0.5 z: -8 } max { x: 8 y: 2 z: 8 } }
    spacing: 2 jitter: 0.3 seed: 3
    templates { mass: 1 linear_velocity { x: 1 } shape { sphere { radius: 0.4 } } }
  }
  player {
    body { name: "player" mass: 80 shape { sphere { radius: 0.5 } } never_sleeps: true }
    spawn_points { x: -5 y: 3 }
    spawn_points { x: 5 y: 3 }
    max_force: 2000
    max_speed: 6
  }
)";
constexpr std::uint64_t kBalls = 30;

bool Is(const v1::WorkerReport& report, v1::WorkerPhase phase) { return report.phase() == phase; }

class WorkerAgentTest : public AgentedWorkers {
 protected:
  WorkerAgentTest() : AgentedWorkers(kInstance, kScene) {}

  void StartWorkers(std::uint32_t regions) {
    regions_ = regions;
    for (std::uint32_t region = 1; region <= regions; ++region) StartWorker(region);
  }
  // The next order for a region: everything, but for what the test takes away again.
  v1::WorkerOrder NextOrder(std::uint32_t region) {
    v1::WorkerOrder order = OrderBy(*MakeGridMap(scene_->ground(), regions_), region);
    order.set_snapshot_rate_hz(20);
    order.mutable_borders()->set_ghost_depth(2);
    return order;
  }
  static v1::Player& AddPlayer(v1::WorkerOrder& order, std::uint32_t number, std::uint32_t spawn_region) {
    v1::Player& player = *order.add_players();
    player.set_number(number);
    player.set_spawn_region(spawn_region);
    return player;
  }
  v1::WorkerReport WaitForPhase(std::uint32_t region, v1::WorkerPhase phase) {
    return Wait(region, [&](const v1::WorkerReport& report) { return Is(report, phase); });
  }
  net::Credentials Credentials(std::uint32_t player, std::uint64_t generation = 1) const {
    return net::IssuePlayer(kInstance, PlayerNumber(player), net::Generation(generation), key_);
  }

  std::uint32_t regions_ = 1;
};

TEST_F(WorkerAgentTest, PhasesFollowTheOrders) {
  StartWorkers(1);
  const v1::WorkerReport first = WaitForPhase(1, v1::WORKER_PHASE_LOADING);
  EXPECT_EQ(first.identity().instance_id(), kInstance);
  EXPECT_EQ(first.identity().region(), 1u);
  EXPECT_EQ(first.identity().incarnation(), 5u);
  EXPECT_EQ(first.identity().pid(), workers_[1]->pid());

  v1::WorkerOrder early = NextOrder(1);
  early.clear_map();
  agent_->Give(early);
  Wait(1, [&](const auto& report) { return report.order_revision() == early.revision(); });
  EXPECT_TRUE(std::ranges::all_of(agent_->ReportsOf(1),
                                  [](const auto& report) { return Is(report, v1::WORKER_PHASE_LOADING); }));

  agent_->Give(NextOrder(1));
  const v1::WorkerReport linked = WaitForPhase(1, v1::WORKER_PHASE_LINKED);  // there is nobody to link to
  EXPECT_NE(linked.address().game_port(), 0u);
  EXPECT_NE(linked.address().link_port(), 0u);
  EXPECT_NE(linked.address().metrics_port(), 0u);
  EXPECT_EQ(linked.address().host(), "127.0.0.1");
  EXPECT_EQ(linked.address().region(), 1u);
  EXPECT_EQ(linked.address().incarnation(), 5u);
  EXPECT_EQ(linked.map_version(), 1u);
  EXPECT_EQ(linked.owned(), kBalls);
  EXPECT_EQ(linked.tick(), 0u);

  v1::WorkerOrder run = NextOrder(1);
  run.set_run(true);
  agent_->Give(run);
  const v1::WorkerReport running = Wait(1, [](const auto& report) { return report.tick() > 90; });
  EXPECT_TRUE(Is(running, v1::WORKER_PHASE_RUNNING));
  EXPECT_GT(running.tick_rate_hz(), 1);
  EXPECT_GT(running.step().p50_seconds(), 0);
  EXPECT_GE(running.step().p99_seconds(), running.step().p50_seconds());
  EXPECT_GE(running.step().max_seconds(), running.step().p99_seconds());
  EXPECT_GT(running.resident_bytes(), 1u << 20);
  ASSERT_GE(running.censuses_size(), 2);
  EXPECT_EQ(running.censuses(0).tick() % 60, 0u);
  EXPECT_EQ(running.censuses(0).owned(), kBalls);

  v1::WorkerOrder stop = run;
  stop.set_revision(++revision_);
  stop.set_stop(true);
  agent_->Give(stop);
  const v1::WorkerReport stopping = WaitForPhase(1, v1::WORKER_PHASE_STOPPING);
  EXPECT_EQ(stopping.failure(), "");
  EXPECT_EQ(workers_[1]->Wait(), 0);
}

TEST_F(WorkerAgentTest, RegionsLinkWhenTheyLearnOfEachOther) {
  StartWorkers(4);
  std::map<std::uint32_t, v1::RegionAddress> addresses;
  for (std::uint32_t region = 1; region <= 4; ++region) {
    agent_->Give(NextOrder(region));
    addresses[region] = WaitForPhase(region, v1::WORKER_PHASE_BOUND).address();
  }
  const auto order_with_peers = [&](std::uint32_t region, bool run) {
    v1::WorkerOrder order = NextOrder(region);
    for (const auto& [other, address] : addresses) *order.add_peers() = address;
    AddPlayer(order, 1, 1);
    AddPlayer(order, 2, 2);
    order.set_run(run);
    return order;
  };
  for (std::uint32_t region = 1; region <= 4; ++region) agent_->Give(order_with_peers(region, false));
  for (std::uint32_t region = 1; region <= 4; ++region) {
    EXPECT_EQ(WaitForPhase(region, v1::WORKER_PHASE_LINKED).linked_regions_size(), 3);
  }
  for (std::uint32_t region = 1; region <= 4; ++region) agent_->Give(order_with_peers(region, true));

  // The census of one tick, summed over the regions, holds each body once: the balls and both players.
  static constexpr std::uint64_t kTick = 120;
  std::uint64_t owned = 0, checksum = 0, expected = 0, spawned = 0;
  for (std::uint32_t region = 1; region <= 4; ++region) {
    const auto at = [](const v1::WorkerReport& report) {
      return std::ranges::find(report.censuses(), kTick, &v1::Census::tick);
    };
    const v1::WorkerReport report = Wait(region, [&](const auto& r) { return at(r) != r.censuses().end(); });
    owned += at(report)->owned();
    checksum += at(report)->id_checksum();
    spawned += report.spawned_bodies();
    EXPECT_EQ(report.removed_bodies(), 0u);
  }
  for (std::uint64_t ball = 0; ball < kBalls; ++ball) expected += region::Mix(BodyId(100 + ball));
  for (const std::uint32_t player : {1u, 2u}) expected += region::Mix(PlayerBodyId(PlayerNumber(player)));
  EXPECT_EQ(owned, kBalls + 2);
  EXPECT_EQ(checksum, expected);
  EXPECT_EQ(spawned, 2u);
}

TEST_F(WorkerAgentTest, RunsOnWhileTheAgentIsAwayAndIsAdopted) {
  StartWorkers(1);
  v1::WorkerOrder order = NextOrder(1);
  order.set_run(true);
  agent_->Give(order);
  const v1::WorkerReport before = Wait(1, [](const auto& report) { return report.tick() > 0; });
  agent_.reset();
  ASSERT_TRUE(workers_[1]->WaitForLine("agent gone"));
  // Only the world's own clock shows that it runs on.
  const auto metrics_port = static_cast<std::uint16_t>(before.address().metrics_port());
  const auto tick = [&] {
    const std::string body = ReadMetrics(metrics_port);
    const auto at = body.find("\ntessera_region_tick ");
    return at == std::string::npos ? 0 : std::atoi(body.c_str() + at + 21);
  };
  const int away_at = tick();
  for (const auto limit = std::chrono::steady_clock::now() + kPatience;
       tick() < away_at + 60 && std::chrono::steady_clock::now() < limit;) {
  }
  EXPECT_GE(tick(), away_at + 60);

  agent_ = std::make_unique<FakeAgent>(socket_, key_);
  const v1::WorkerReport adopted = Wait(1, [](const auto&) { return true; });
  EXPECT_EQ(adopted.identity().pid(), workers_[1]->pid());
  EXPECT_EQ(adopted.identity().incarnation(), 5u);
  EXPECT_EQ(adopted.order_revision(), order.revision());
  EXPECT_TRUE(Is(adopted, v1::WORKER_PHASE_RUNNING));
  EXPECT_EQ(adopted.address().game_port(), before.address().game_port());

  v1::WorkerOrder stop = NextOrder(1);
  stop.set_stop(true);
  agent_->Give(stop);
  EXPECT_EQ(workers_[1]->Wait(), 0);
}

TEST_F(WorkerAgentTest, EndsWhenTheAgentDoesNotKnowIt) {
  agent_.reset();
  agent_ = std::make_unique<FakeAgent>(socket_, key_, false);
  StartWorkers(1);
  EXPECT_EQ(workers_[1]->Wait(), 0);
  EXPECT_TRUE(workers_[1]->WaitForLine("the agent does not know this worker"));
}

TEST_F(WorkerAgentTest, SigtermIsReportedBeforeTheEnd) {
  StartWorkers(1);
  v1::WorkerOrder order = NextOrder(1);
  order.set_run(true);
  agent_->Give(order);
  WaitForPhase(1, v1::WORKER_PHASE_RUNNING);
  workers_[1]->Signal(SIGTERM);
  WaitForPhase(1, v1::WORKER_PHASE_STOPPING);
  EXPECT_EQ(workers_[1]->Wait(), 0);
}

TEST_F(WorkerAgentTest, SceneThatIsNotTheOrderedOneIsReportedAndFails) {
  StartWorkers(1);
  v1::WorkerOrder order = NextOrder(1);
  order.set_scene_hash(std::string(64, '0'));
  agent_->Give(order);
  const v1::WorkerReport report = Wait(1, [](const auto& r) { return !r.failure().empty(); });
  EXPECT_TRUE(Is(report, v1::WORKER_PHASE_STOPPING));
  EXPECT_NE(report.failure().find("scene.pb"), std::string::npos) << report.failure();
  EXPECT_EQ(workers_[1]->Wait(), 1);
}

TEST_F(WorkerAgentTest, OrderForAnotherOrWithoutSenseIsNotTaken) {
  StartWorkers(1);
  v1::WorkerOrder other = NextOrder(1);
  other.set_instance_id("inst-4");
  other.set_stop(true);
  agent_->Give(other);
  ASSERT_TRUE(workers_[1]->WaitForLine("order refused"));
  v1::WorkerOrder broken = NextOrder(1);
  broken.mutable_map()->mutable_cells(0)->set_owner(9);
  agent_->Give(broken);
  ASSERT_TRUE(workers_[1]->WaitForLine("cells[0]"));
  agent_->Give(NextOrder(1));
  WaitForPhase(1, v1::WORKER_PHASE_LINKED);
}

TEST_F(WorkerAgentTest, PlayerWhoIsFasterThanTheOrderIsLetInWhenTheOrderComes) {
  StartWorkers(1);
  v1::WorkerOrder order = NextOrder(1);
  order.set_run(true);
  agent_->Give(order);
  const v1::WorkerReport running = WaitForPhase(1, v1::WORKER_PHASE_RUNNING);
  TestClient client(scene_->bounds);
  ASSERT_TRUE(client.Connect(static_cast<std::uint16_t>(running.address().game_port()), RegionId(1), Credentials(1)));
  v1::WorkerOrder with_player = NextOrder(1);
  with_player.set_run(true);
  AddPlayer(with_player, 1, 1);
  agent_->Give(with_player);
  ASSERT_TRUE(client.Until([&] { return client.welcome.has_value() && client.bodies.size() == kBalls + 1; }));
  EXPECT_EQ(client.welcome->snapshot_rate_hz(), 20u);
  const v1::WorkerReport report = Wait(1, [](const auto& r) { return r.connected_players_size() == 1; });
  EXPECT_EQ(report.connected_players(0), 1u);
}

TEST_F(WorkerAgentTest, PlayerThatNobodyKnowsIsRefused) {
  StartWorkers(1);
  agent_->Give(NextOrder(1));
  const v1::WorkerReport linked = WaitForPhase(1, v1::WORKER_PHASE_LINKED);
  TestClient client(scene_->bounds);
  ASSERT_TRUE(client.Connect(static_cast<std::uint16_t>(linked.address().game_port()), RegionId(1), Credentials(8)));
  ASSERT_TRUE(client.Until([&] { return client.refusal.has_value(); }));
  EXPECT_EQ(client.refusal->reason(), v1::REFUSAL_REASON_UNKNOWN_PLAYER);
  EXPECT_NE(client.refusal->detail().find("8"), std::string::npos);
}

// A player that left long ago is named by no order any more. Its credential is as good as ever, so it would be waited
// for again and again.
TEST_F(WorkerAgentTest, OneThatNobodyKnowsAndComesAgainAndAgainIsSoonNotLookedAt) {
  StartWorkers(1);
  agent_->Give(NextOrder(1));
  const v1::WorkerReport linked = WaitForPhase(1, v1::WORKER_PHASE_LINKED);
  const auto port = static_cast<std::uint16_t>(linked.address().game_port());
  TestClient first(scene_->bounds), second(scene_->bounds), third(scene_->bounds), again(scene_->bounds);
  const net::Credentials grant = Credentials(8);
  for (TestClient* client : {&first, &second, &third}) ASSERT_TRUE(client->Connect(port, RegionId(1), grant));
  ASSERT_TRUE(Until({&first, &second, &third}, [&] { return first.refusal && second.refusal && third.refusal; }));
  EXPECT_EQ(third.refusal->reason(), v1::REFUSAL_REASON_UNKNOWN_PLAYER);
  EXPECT_FALSE(again.Connect(port, RegionId(1), grant));
  ASSERT_TRUE(again.refusal.has_value());
  EXPECT_EQ(again.refusal->reason(), v1::REFUSAL_REASON_BAD_CREDENTIAL);
  EXPECT_THAT(again.refusal->detail(), testing::HasSubstr("too often"));
}

TEST_F(WorkerAgentTest, PlayerThatLeavesLosesItsBodyAndItsConnection) {
  StartWorkers(1);
  v1::WorkerOrder order = NextOrder(1);
  order.set_run(true);
  AddPlayer(order, 1, 1);
  agent_->Give(order);
  const v1::WorkerReport there = Wait(1, [](const auto& report) { return report.spawned_bodies() == 1; });
  EXPECT_EQ(there.owned(), kBalls + 1);
  TestClient client(scene_->bounds);
  ASSERT_TRUE(client.Connect(static_cast<std::uint16_t>(there.address().game_port()), RegionId(1), Credentials(1)));
  ASSERT_TRUE(client.Until([&] { return client.welcome.has_value(); }));

  v1::WorkerOrder left = NextOrder(1);
  left.set_run(true);
  AddPlayer(left, 1, 1).set_left(true);
  agent_->Give(left);
  EXPECT_TRUE(client.Until([&] { return client.disconnected; }));
  const v1::WorkerReport gone = Wait(1, [](const auto& report) { return report.removed_bodies() == 1; });
  EXPECT_EQ(gone.owned(), kBalls);
  EXPECT_EQ(gone.spawned_bodies(), 1u);

  TestClient again(scene_->bounds);
  ASSERT_TRUE(again.Connect(static_cast<std::uint16_t>(there.address().game_port()), RegionId(1), Credentials(1)));
  ASSERT_TRUE(again.Until([&] { return again.refusal.has_value(); }));
  EXPECT_EQ(again.refusal->reason(), v1::REFUSAL_REASON_UNKNOWN_PLAYER);
}

// The order may come before the newer process does.
TEST_F(WorkerAgentTest, AnOrderWithAHigherGenerationEndsTheOlderProcess) {
  StartWorkers(1);
  const auto order_with = [&](std::uint32_t generation) {
    v1::WorkerOrder order = NextOrder(1);
    order.set_run(true);
    AddPlayer(order, 1, 1).set_generation(generation);
    return order;
  };
  agent_->Give(order_with(1));
  const v1::WorkerReport there = Wait(1, [](const auto& report) { return report.spawned_bodies() == 1; });
  const auto port = static_cast<std::uint16_t>(there.address().game_port());
  TestClient older(scene_->bounds), newer(scene_->bounds), again(scene_->bounds);
  ASSERT_TRUE(older.Connect(port, RegionId(1), Credentials(1, 1)));
  ASSERT_TRUE(older.Until([&] { return older.welcome.has_value(); }));
  agent_->Give(order_with(2));
  ASSERT_TRUE(older.Until([&] { return older.disconnected; }));
  ASSERT_TRUE(older.refusal.has_value());
  EXPECT_EQ(older.refusal->reason(), v1::REFUSAL_REASON_REPLACED);
  ASSERT_TRUE(again.Connect(port, RegionId(1), Credentials(1, 1)));
  ASSERT_TRUE(again.Until([&] { return again.refusal.has_value(); }));
  EXPECT_EQ(again.refusal->reason(), v1::REFUSAL_REASON_REPLACED);
  ASSERT_TRUE(newer.Connect(port, RegionId(1), Credentials(1, 2)));
  EXPECT_TRUE(newer.Until([&] { return newer.bodies.contains(PlayerBodyId(PlayerNumber(1))); })) << "its body is there";
}

// An order that names a player no more says that it left long ago: here it was on its way all that time.
TEST_F(WorkerAgentTest, BodyOfAForgottenPlayerIsRemoved) {
  StartWorkers(1);
  v1::WorkerOrder both = NextOrder(1);
  both.set_run(true);
  AddPlayer(both, 1, 1);
  AddPlayer(both, 2, 1);
  agent_->Give(both);
  (void)Wait(1, [](const auto& report) { return report.spawned_bodies() == 2; });
  v1::WorkerOrder one = NextOrder(1);
  one.set_run(true);
  AddPlayer(one, 2, 1);
  agent_->Give(one);
  EXPECT_EQ(Wait(1, [](const auto& report) { return report.removed_bodies() == 1; }).owned(), kBalls + 1);
}

// It hangs where it was made, 3 m up, and falls once it is parked no more.
TEST_F(WorkerAgentTest, ParkedPlayersBodyHangsWhereItIs) {
  StartWorkers(1);
  const auto order_with = [&](bool parked) {
    v1::WorkerOrder order = NextOrder(1);
    order.set_run(true);
    AddPlayer(order, 1, 1).set_parked(parked);
    return order;
  };
  agent_->Give(order_with(true));
  const v1::WorkerReport there = Wait(1, [](const auto& report) { return report.spawned_bodies() == 1; });
  TestClient client(scene_->bounds);
  ASSERT_TRUE(client.Connect(static_cast<std::uint16_t>(there.address().game_port()), RegionId(1), Credentials(1)));
  const BodyId body = PlayerBodyId(PlayerNumber(1));
  const auto height = [&] { return client.bodies.at(body).position.y; };
  ASSERT_TRUE(client.Until([&] { return client.tick.value() > 90 && client.bodies.contains(body); }));
  EXPECT_NEAR(height(), 3, 0.01);
  agent_->Give(order_with(false));
  EXPECT_TRUE(client.Until([&] { return height() < 1; }));
}

}  // namespace
}  // namespace tessera::worker
