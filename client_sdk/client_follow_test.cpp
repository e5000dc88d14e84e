// A client follows the world: maps that change, regions that come, go and move, interest that wanders.
#include <gtest/gtest.h>

#include "client_sdk/client_fixture.h"

namespace tessera::client {
namespace {

using replication::BodyRecord;

using ClientFollowTest = ClientFixture;

// The map as it is, but `from`'s cells belong to `to`, in whose favour their epoch has grown.
PartitionMap Handed(const PartitionMap& map, RegionId from, RegionId to) {
  std::vector<Cell> cells(map.cells().begin(), map.cells().end());
  for (Cell& cell : cells) {
    if (cell.owner != from) continue;
    cell.owner = to;
    cell.epoch = Epoch(cell.epoch.value() + 1);
  }
  std::vector<MapRegion> regions;
  for (const MapRegion& region : map.regions()) {
    if (region.id != from && region.id != to) regions.push_back({region.id, RegionId()});
  }
  regions.push_back({to, RegionId()});
  std::sort(regions.begin(), regions.end(), [](const MapRegion& a, const MapRegion& b) { return a.id < b.id; });
  return *PartitionMap::Create(MapVersion(map.version().value() + 1), map.bounds(), cells, regions);
}

TEST_F(ClientFollowTest, AnotherRegionTakesTheGoneOnesPlaceUnseen) {
  Make(2);
  Join();
  Play();
  const std::vector<BodyRecord> ball = {{kBall, Epoch(1), Moving(5, 0)}};
  Advance([&](Tick t) { instance->regions[1]->Snapshot(t, ball); });
  ASSERT_TRUE(client->World().contains(kBall));

  FakeRegion& third = instance->Add(RegionId(3));
  third.started = true;
  const PartitionMap next = Handed(instance->map, RegionId(2), RegionId(3));
  instance->regions[0]->TellMap(next, {third.Where()});
  ASSERT_TRUE(Until([&] { return third.clients() == 1 && instance->regions[1]->clients() == 0; }, true));
  EXPECT_TRUE(client->World().contains(kBall));  // as it was last, until its new owner speaks
  EXPECT_NEAR(client->World().at(kBall).state.position.x, 5, 1e-3);

  const std::vector<BodyRecord> owned = {{kBall, Epoch(2), Moving(5.5, 0)}};
  for (int i = 0; i < 400; ++i) Advance([&](Tick t) { third.Snapshot(t, owned); });  // 13 s
  ASSERT_TRUE(client->World().contains(kBall));
  EXPECT_EQ(client->World().at(kBall).region, RegionId(3));
  EXPECT_EQ(Count(ClientEvent::Kind::kAppeared), 1);
  EXPECT_EQ(Count(ClientEvent::Kind::kVanished), 0);
  EXPECT_EQ(client->Stats().regions.size(), 2u);
}

// A client that hears late hears all at once: the map by which another has the last region's place, and that this ends.
TEST_F(ClientFollowTest, TheEndOfTheLastRegionItKnewIsNotTheEndOfTheWorld) {
  Make(1);
  Join();
  Play();
  FakeRegion& second = instance->Add(RegionId(2));
  second.started = true;
  instance->regions[0]->TellMap(Handed(instance->map, RegionId(1), RegionId(2)), {second.Where()});
  instance->regions[0]->Stop("the instance ends");
  ASSERT_TRUE(Until([&] { return second.clients() == 1; }));
  EXPECT_EQ(client->state(), ClientState::kPlaying);
}

TEST_F(ClientFollowTest, WhatNobodyTakesOverVanishesAfterAWhile) {
  Make(2);
  Join();
  Play();
  const std::vector<BodyRecord> ball = {{kBall, Epoch(1), Moving(5, 0)}};
  Advance([&](Tick t) { instance->regions[1]->Snapshot(t, ball); });
  instance->regions[0]->TellMap(Handed(instance->map, RegionId(2), RegionId(1)));
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kMapChanged) == 1; }));
  now += WorldView::kOrphaned / 2;
  PollOnce();
  EXPECT_TRUE(client->World().contains(kBall));
  now += WorldView::kOrphaned / 2;
  PollOnce();
  EXPECT_FALSE(client->World().contains(kBall));
  EXPECT_EQ(Count(ClientEvent::Kind::kVanished), 1);
}

TEST_F(ClientFollowTest, AnEndpointThatMovesIsFound) {
  Make(2);
  Join();
  Play();
  FakeRegion& again = instance->Add(RegionId(2), Incarnation(2));
  again.started = true;
  instance->regions[0]->TellMap(instance->map, {again.Where()});
  ASSERT_TRUE(Until([&] { return again.clients() == 1; }));
  for (int i = 0; i < 50; ++i) PollOnce();
  EXPECT_EQ(Count(ClientEvent::Kind::kRegionBack), Count(ClientEvent::Kind::kRegionLost))
      << "back is only what was lost";
  // News that are older than that count for nothing.
  instance->regions[0]->TellMap(instance->map, {instance->regions[1]->Where()});
  for (int i = 0; i < 50; ++i) PollOnce();
  EXPECT_EQ(again.clients(), 1u);
}

TEST_F(ClientFollowTest, EndpointsThatMakeNoSenseAreCountedAndDropped) {
  Make(1);
  Join();
  Play();
  v1::RegionEndpoint nowhere = instance->regions[0]->Where();
  nowhere.set_game_port(70'000);
  nowhere.set_incarnation(9);
  instance->regions[0]->TellMap(instance->map, {nowhere});
  ASSERT_TRUE(Until([&] { return client->Stats().decode_errors == 1; }));
  EXPECT_EQ(instance->regions[0]->clients(), 1u);
}

TEST_F(ClientFollowTest, OnlyRegionsThatItsInterestTouchesAreListenedTo) {
  Make(4, "view { radius: 10 } ");  // 50 m squares around the origin
  Join();
  Play();
  const auto connected = [&] {
    std::string regions;
    for (const RegionStats& region : client->Stats().regions) {
      if (region.connected) regions += std::to_string(region.region.value());
    }
    return regions;
  };
  double x = -25;
  const auto own = [&] {
    BodyState state = Moving(x, 0);
    state.position.z = -25;
    return std::vector<BodyRecord>{{kBall, Epoch(1), Moving(-30, 0)}, {client->own_body(), Epoch(1), state}};
  };
  const std::vector<BodyRecord> far = {{BodyId(1 << 20), Epoch(1), Moving(30, 0)}};
  Advance([&](Tick t) {
    instance->regions[0]->Snapshot(t, own());
    instance->regions[3]->Snapshot(t, far);
  });
  ASSERT_TRUE(Until([&] { return connected() == "1"; })) << connected();
  EXPECT_FALSE(client->World().contains(BodyId(1 << 20)));
  EXPECT_TRUE(client->World().contains(kBall));
  EXPECT_EQ(client->state(), ClientState::kPlaying);

  x = -12;  // 2 m more than what is of interest, and the margin is 2.5
  Advance([&](Tick t) { instance->regions[0]->Snapshot(t, own()); });
  EXPECT_TRUE(Until([&] { return connected() == "12"; })) << connected();
  x = -14;  // within the hysteresis
  for (int i = 0; i < 10; ++i) Advance([&](Tick t) { instance->regions[0]->Snapshot(t, own()); });
  EXPECT_EQ(connected(), "12");
  x = -16;
  Advance([&](Tick t) { instance->regions[0]->Snapshot(t, own()); });
  EXPECT_TRUE(Until([&] { return connected() == "1"; })) << connected();
  EXPECT_EQ(Count(ClientEvent::Kind::kRegionLost), 0);  // nothing was lost
}

// All that it listens to dies with one machine; who has taken its place is none that it knows to be near.
TEST_F(ClientFollowTest, WhenAllThatAreNearFallSilentTheOthersAreAsked) {
  Make(4, "view { radius: 10 } ");
  Join();
  Play();
  const auto own = [&] {
    BodyState state = Moving(-25, 0);
    state.position.z = -25;
    return std::vector<BodyRecord>{{client->own_body(), Epoch(1), state}};
  };
  Advance([&](Tick t) { instance->regions[0]->Snapshot(t, own()); });
  const auto clients = [&](std::size_t i) { return instance->regions[i]->clients(); };
  ASSERT_TRUE(Until([&] { return clients(0) == 1 && clients(1) + clients(2) + clients(3) == 0; }));
  const PartitionMap next = Handed(instance->map, RegionId(1), RegionId(4));
  instance->End(0);  // 2, 3 and 4 are left
  ASSERT_TRUE(Until([&] { return clients(0) == 1 && clients(1) == 1 && clients(2) == 1; }, true));
  for (const auto& region : instance->regions) region->TellMap(next);
  ASSERT_TRUE(Until([&] { return clients(0) + clients(1) == 0; }, true));
  EXPECT_EQ(clients(2), 1U);
  EXPECT_EQ(client->state(), ClientState::kPlaying);
}

TEST_F(ClientFollowTest, ComesBackAsTheSamePlayerAfterTheLossOfAllLinks) {
  Make(2);
  Join();
  Play();
  const std::vector<BodyRecord> ball = {{kBall, Epoch(1), Moving(5, 0)}};
  Advance([&](Tick t) { instance->regions[0]->Snapshot(t, ball); });
  for (std::size_t i = 0; i < 2; ++i) {
    instance->Restart(i);
    instance->regions[i]->started = true;
  }
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionLost) == 2; }, true));
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionBack) == 2; }, true));
  EXPECT_EQ(client->state(), ClientState::kPlaying);
  EXPECT_EQ(client->player(), PlayerNumber(1));
  EXPECT_TRUE(client->World().contains(kBall));
  EXPECT_EQ(Count(ClientEvent::Kind::kVanished), 0);
}

// A restore as a client sees it: all workers end, others go on from a checkpoint at other addresses.
struct ClientRestoreTest : ClientFixture {
  void PlayByGrant() {
    Make(1);
    GrantOptions options;
    options.bind_address = "127.0.0.1";
    auto joined = Client::JoinByGrant(instance->Grant(), options);
    ASSERT_TRUE(joined.ok()) << joined.status();
    client = *std::move(joined);
    ASSERT_NO_FATAL_FAILURE(Play());
    for (int i = 0; i < 60; ++i) {
      Advance([&](Tick t) { instance->regions[0]->Snapshot(t, At(40)); });
    }
    ASSERT_TRUE(client->World().contains(kBall));
  }
  // All workers end, and say that the world goes on.
  void EndTheProcesses() {
    instance->regions[0]->Stop("the region goes on elsewhere", true);
    ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionLost) == 1; }));
    instance->EndAll();
  }
  static std::vector<BodyRecord> At(double x) { return {{kBall, Epoch(1), Moving(x, 0)}}; }
  void Wait(std::chrono::milliseconds time) {
    for (const TimePoint until = now + time; now < until; now += std::chrono::milliseconds(50)) PollOnce();
  }
};

TEST_F(ClientRestoreTest, AWorldThatGoesOnElsewhereHasNotEnded) {
  ASSERT_NO_FATAL_FAILURE(PlayByGrant());
  instance->regions[0]->Stop("the region goes on elsewhere", true);
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionLost) == 1; }));
  EXPECT_EQ(client->state(), ClientState::kPlaying);
  EXPECT_EQ(Count(ClientEvent::Kind::kEnded), 0);
}

TEST_F(ClientRestoreTest, OneThatEndsHasEnded) {
  ASSERT_NO_FATAL_FAILURE(PlayByGrant());
  instance->regions[0]->Stop("the instance ends");
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kEnded; }));
  EXPECT_TRUE(client->reason().ok()) << client->reason();
  EXPECT_FALSE(client->needs_new_grant());
}

TEST_F(ClientRestoreTest, ANewGrantLeadsBackIntoARestoredWorldAsTheSamePlayer) {
  ASSERT_NO_FATAL_FAILURE(PlayByGrant());
  const PlayerNumber player = client->player();
  ASSERT_NO_FATAL_FAILURE(EndTheProcesses());
  Wait(std::chrono::milliseconds(3500));
  ASSERT_EQ(Count(ClientEvent::Kind::kGrantNeeded), 1) << "once a silence";
  EXPECT_EQ(client->state(), ClientState::kPlaying);

  FakeRegion& restored = instance->Add(RegionId(1), Incarnation(7));
  restored.started = true;
  events.clear();
  ASSERT_TRUE(client->Renew(instance->Grant(false, player)).ok());
  ASSERT_TRUE(Until([&] { return restored.clients() == 1; }, true));
  const Tick earlier(10);
  now += 2 * kTick;
  restored.Snapshot(earlier, At(-20));
  ASSERT_TRUE(Until([&] { return client->tick() == earlier; })) << client->tick().value();
  EXPECT_EQ(Count(ClientEvent::Kind::kRestored), 1);
  EXPECT_EQ(Count(ClientEvent::Kind::kVanished), 1);
  EXPECT_EQ(Count(ClientEvent::Kind::kAppeared), 1);
  EXPECT_EQ(Count(ClientEvent::Kind::kRegionBack), 1);
  EXPECT_NEAR(client->World().at(kBall).state.position.x, -20, 0.01);
  tick = earlier;
  for (int i = 0; i < 30; ++i) {
    Advance([&](Tick t) { restored.Snapshot(t, At(-20 + 0.1 * i)); });
  }
  const std::vector<ShownBody> shown = client->Interpolated(now);
  ASSERT_EQ(shown.size(), 1u);
  EXPECT_NEAR(shown[0].pose.position.x, -17.5, 0.6) << "the shown moment is the restored world's";
  EXPECT_EQ(client->state(), ClientState::kPlaying);
}

TEST_F(ClientRestoreTest, SeveralRegionsThatAnswerBeforeTheFirstSnapshotMakeNoDifference) {
  Make(2);
  Join();
  Play();
  for (int i = 0; i < 90; ++i) {
    Advance([&](Tick t) { instance->regions[0]->Snapshot(t, At(40)); });
  }
  for (const auto& region : instance->regions) region->Stop("the region goes on elsewhere", true);
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionLost) == 2; }));
  instance->EndAll();
  for (const RegionId id : {RegionId(1), RegionId(2)}) instance->Add(id, Incarnation(7)).started = true;
  ASSERT_TRUE(client->Renew(instance->Grant(false, client->player())).ok());
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionBack) == 2; }, true));
  const Tick earlier(10);
  now += 2 * kTick;
  instance->regions[1]->Snapshot(earlier, At(-20));
  ASSERT_TRUE(Until([&] { return client->tick() == earlier; })) << client->tick().value();
  EXPECT_EQ(Count(ClientEvent::Kind::kRestored), 1);
}

TEST_F(ClientRestoreTest, WithoutANewGrantItEndsAndSaysSo) {
  ASSERT_NO_FATAL_FAILURE(PlayByGrant());
  ASSERT_NO_FATAL_FAILURE(EndTheProcesses());
  Wait(std::chrono::seconds(60));
  EXPECT_EQ(client->state(), ClientState::kEnded);
  EXPECT_TRUE(client->needs_new_grant());
  EXPECT_EQ(Count(ClientEvent::Kind::kGrantNeeded), 1);
  const std::vector<std::uint8_t> any(10);
  EXPECT_EQ(client->Renew(any).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(ClientRestoreTest, AGrantOfSomebodyElseIsRefused) {
  ASSERT_NO_FATAL_FAILURE(PlayByGrant());
  EXPECT_EQ(client->Renew({}).code(), absl::StatusCode::kInvalidArgument);
  const absl::Status other = client->Renew(instance->Grant(false, PlayerNumber(9)));
  EXPECT_EQ(other.message(), "grant: is for player 9, not for 1");
  EXPECT_TRUE(client->Renew(instance->Grant(false, client->player())).ok());
  for (int i = 0; i < 20; ++i) PollOnce();
  EXPECT_EQ(Count(ClientEvent::Kind::kRegionLost), 0) << "what is connected stays so";
}

}  // namespace
}  // namespace tessera::client
