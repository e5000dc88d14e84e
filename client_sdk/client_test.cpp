// A client against a fake instance over real sockets. Time is the test's own: it stands while datagrams are on their
// way, so nothing depends on how fast this machine is.
#include "client_sdk/client.h"

#include <gtest/gtest.h>

#include <set>

#include "client_sdk/client_fixture.h"

namespace tessera::client {
namespace {

using replication::BodyRecord;
using replication::DepartureRecord;

using ClientTest = ClientFixture;

TEST_F(ClientTest, JoinsWaitsPlaysAndLeaves) {
  Make(1);
  Join();
  EXPECT_EQ(client->state(), ClientState::kJoining);
  EXPECT_EQ(client->player(), PlayerNumber(1));
  EXPECT_EQ(client->own_body(), PlayerBodyId(PlayerNumber(1)));
  EXPECT_EQ(client->scene().name, "plaza");
  Play();
  EXPECT_EQ(Count(ClientEvent::Kind::kStarted), 1);
  EXPECT_TRUE(client->Leave().ok());
  EXPECT_EQ(client->state(), ClientState::kEnded);
  EXPECT_TRUE(client->reason().ok());
  EXPECT_EQ(instance->left, 1);
}

TEST_F(ClientTest, AViewerSeesAllAndTakesNoPart) {
  Make(2, "view { radius: 5 }");
  JoinOptions options = Options();
  options.watch = options.predict = true;
  auto joined = Client::Join(options);
  ASSERT_TRUE(joined.ok()) << joined.status();
  client = *std::move(joined);
  EXPECT_EQ(client->player(), PlayerNumber());
  EXPECT_EQ(client->own_body(), BodyId());
  EXPECT_TRUE(client->return_token().empty());
  Play();
  const std::vector<replication::BodyRecord> west = {{BodyId(1), Epoch(1), Moving(-45, 1)}},
                                             east = {{BodyId(2), Epoch(1), Moving(45, 1)}};
  Advance([&](Tick at) {
    instance->regions[0]->Snapshot(at, west);
    instance->regions[1]->Snapshot(at, east);
  });
  ASSERT_TRUE(Until([&] { return client->World().size() == 2; })) << "further apart than a player sees";
  client->Move({1, 0, 0}, {});
  EXPECT_EQ(client->MoveBody(BodyId(1), {1, 0, 0}, {}), 0u);
  EXPECT_EQ(client->Send("hello").code(), absl::StatusCode::kFailedPrecondition);
  for (int i = 0; i < 10; ++i) {
    now += kTick;
    PollOnce();
  }
  for (const auto& region : instance->regions) {
    EXPECT_TRUE(region->inputs.empty());
    EXPECT_TRUE(region->commands.empty());
  }
  EXPECT_TRUE(client->Leave().ok());
  EXPECT_EQ(client->state(), ClientState::kEnded);
  EXPECT_EQ(instance->left, 0) << "nobody has to be told";
}

TEST_F(ClientTest, ASceneIsFetchedOnce) {
  Make(1);
  Join();
  Join();
  EXPECT_LE(instance->scenes_fetched, 1);  // another test may have had it before
}

TEST_F(ClientTest, AnUnknownInstanceIsNamed) {
  Make(1);
  JoinOptions options = Options();
  options.instance_id = "nowhere-3";
  const auto joined = Client::Join(options);
  EXPECT_EQ(joined.status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(joined.status().message(), "instance nowhere-3: no such instance");
}

TEST_F(ClientTest, AFullInstanceSaysSo) {
  Make(1);
  instance->full = true;
  const auto joined = Client::Join(Options());
  EXPECT_EQ(joined.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(joined.status().message(), "instance plaza-1: full: 64 players");
}

TEST_F(ClientTest, AWrongControlAddressIsNamed) {
  const auto joined =
      Client::Join({.control_address = "unix:/nowhere/control.sock", .instance_id = "plaza-1", .player_name = ""});
  EXPECT_EQ(joined.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(std::string(joined.status().message()).rfind("control plane at unix:/nowhere/control.sock: ", 0), 0u)
      << joined.status();
}

TEST_F(ClientTest, AnswersThatMakeNoSenseAreRefused) {
  Make(2);
  instance->wrong_hash = true;
  EXPECT_EQ(Client::Join(Options()).status().code(), absl::StatusCode::kInternal);
  instance->wrong_hash = false;
  instance->forget_a_region = true;
  EXPECT_EQ(Client::Join(Options()).status().message(), "the control plane's answer: regions: not those of the map");
  instance->forget_a_region = false;
  instance->short_instance_key = true;
  EXPECT_EQ(Client::Join(Options()).status().message(),
            "the control plane's answer: instance_key has 31 bytes; it needs 32");
}

TEST_F(ClientTest, ACredentialOfAnotherKeyIsRefusedWithItsReason) {
  Make(2);
  instance->wrong_key = true;
  Join();
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kEnded; }));
  EXPECT_EQ(client->reason().code(), absl::StatusCode::kUnauthenticated);
  ASSERT_NE(Find(ClientEvent::Kind::kEnded), nullptr);
  EXPECT_NE(Find(ClientEvent::Kind::kEnded)->detail.find("refuses: BAD_CREDENTIAL: the player credential is damaged"),
            std::string::npos)
      << Find(ClientEvent::Kind::kEnded)->detail;
}

TEST_F(ClientTest, ARegionThatTakesItForSomebodyElseEndsIt) {
  Make(1);
  instance->regions[0]->welcome_as = PlayerNumber(9);
  Join();
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kEnded; }));
  EXPECT_EQ(client->reason().code(), absl::StatusCode::kInternal);
}

TEST_F(ClientTest, ARegionThatDoesNotAnswerIsNamed) {
  Make(2);
  const std::uint16_t port = instance->regions[1]->port();
  Join();
  instance->End(1);
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kEnded; }, true));
  EXPECT_EQ(client->reason().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(client->reason().message(), "region 2 at 127.0.0.1:" + std::to_string(port) + " does not answer");
}

TEST_F(ClientTest, AnInstanceThatStopsEndsItInOrder) {
  Make(2);
  Join();
  Play();
  for (const auto& region : instance->regions) region->Stop("deleted");
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kEnded; }));
  EXPECT_TRUE(client->reason().ok());
  EXPECT_EQ(Find(ClientEvent::Kind::kEnded)->detail, "the instance ends: deleted");
}

TEST_F(ClientTest, SeesBodiesAppearMoveAndVanish) {
  Make(1);
  Join();
  Play();
  for (int i = 0; i < 20; ++i) {
    const std::vector<BodyRecord> bodies = {{kBall, Epoch(1), Moving(0.1 * i, 3)}};
    Advance([&](Tick t) { instance->regions[0]->Snapshot(t, bodies); });
    ASSERT_EQ(client->World().size(), 1u);
    EXPECT_NEAR(client->World().at(kBall).state.position.x, 0.1 * i, 1.0 / 2048 + 1e-9);
  }
  const std::vector<DepartureRecord> departures = {{kBall, Epoch(1), RegionId()}};
  Advance([&](Tick t) { instance->regions[0]->Snapshot(t, {}, departures); });
  EXPECT_TRUE(client->World().empty());
  EXPECT_EQ(Count(ClientEvent::Kind::kAppeared), 1);
  EXPECT_EQ(Count(ClientEvent::Kind::kVanished), 1);
  const ClientStats stats = client->Stats();
  EXPECT_GE(stats.full_records, 1u);
  EXPECT_GE(stats.delta_records, 15u);
  EXPECT_EQ(stats.full_records + stats.delta_records, 20u);
  EXPECT_EQ(stats.decode_errors, 0u);
  EXPECT_EQ(stats.datagrams_lost, 0u);
  EXPECT_GT(stats.bytes_in_per_s, 0);
  EXPECT_GT(stats.frame_time.count, 20u);
}

// A ball rolls from one region into the other, which takes it over at tick 60; datagrams are lost on both ways.
TEST_F(ClientTest, TwoRegionsAreOneWorldThroughAHandover) {
  Make(2);
  Join();
  Play();
  instance->regions[0]->drop_share = 0.3;
  constexpr double kSpeed = 4;
  for (int i = 0; i < 90; ++i) {
    tick = tick + 2;
    now += 2 * kTick;
    const double x = kSpeed * static_cast<double>(tick.value()) / kTickRate - 4;
    const bool east = tick >= Tick(60);
    const std::vector<BodyRecord> ball = {{kBall, Epoch(east ? 2 : 1), Moving(x, kSpeed)}};
    const std::vector<DepartureRecord> leaves = {{kBall, Epoch(1), RegionId(2)}};
    if (east) {
      instance->regions[0]->Snapshot(tick, {}, tick == Tick(60) ? leaves : std::vector<DepartureRecord>());
      instance->regions[1]->Snapshot(tick, ball);
    } else {
      instance->regions[0]->Snapshot(tick, ball);
      instance->regions[1]->Snapshot(tick, {});
    }
    ASSERT_TRUE(Until([&] { return client->tick() == tick; }));
    for (int more = 0; more < 3; ++more) PollOnce();
    if (i < 3) continue;  // by then it has been heard of, whatever was lost
    ASSERT_EQ(client->World().size(), 1u) << "tick " << tick;
    const std::vector<ShownBody> shown = client->Interpolated(now);
    ASSERT_EQ(shown.size(), 1u);
    ASSERT_EQ(shown[0].seen, &client->World().at(kBall));
  }
  EXPECT_EQ(client->World().at(kBall).region, RegionId(2));
  EXPECT_EQ(client->World().at(kBall).epoch, Epoch(2));
  EXPECT_EQ(Count(ClientEvent::Kind::kAppeared), 1);
  EXPECT_EQ(Count(ClientEvent::Kind::kVanished), 0);
  EXPECT_GT(client->Stats().datagrams_lost, 5u);
}

// Shown at 144 Hz between snapshots at 30: the ball is where it was `lag` ago, with one and the same lag, to a
// millimetre.
TEST_F(ClientTest, InterpolationFollowsTheTruthSmoothly) {
  Make(1);
  Join();
  Play();
  constexpr double kSpeed = 5;
  const TimePoint start = now;
  const auto seconds = [&](TimePoint t) { return std::chrono::duration<double>(t - start).count(); };
  TimePoint next_snapshot = start;
  double previous_x = 0, least_lag = 1e9, most_lag = 0;
  int frames = 0;
  for (int frame = 0; frame < 144 * 6; ++frame) {
    now = start + frame * std::chrono::nanoseconds(1'000'000'000 / 144);
    if (now >= next_snapshot) {
      tick = tick + 2;
      next_snapshot += 2 * kTick;
      const double truth = kSpeed * static_cast<double>(tick.value()) / kTickRate - 20;
      const std::vector<BodyRecord> ball = {{kBall, Epoch(1), Moving(truth, kSpeed)}};
      instance->regions[0]->Snapshot(tick, ball);
      ASSERT_TRUE(Until([&] { return client->tick() == tick; }));
    }
    PollOnce();
    const std::vector<ShownBody> shown = client->Interpolated(now);
    ASSERT_EQ(shown.size(), 1u);
    const double x = shown[0].pose.position.x;
    if (seconds(now) > 2) {
      const double lag = seconds(now) - (x + 20) / kSpeed;
      least_lag = std::min(least_lag, lag);
      most_lag = std::max(most_lag, lag);
      EXPECT_NEAR((x - previous_x) * 144, kSpeed, 0.15 * kSpeed);  // quantised to 1 mm, seen over 7 ms
      ++frames;
    }
    previous_x = x;
  }
  EXPECT_GT(frames, 500);
  EXPECT_LT(most_lag - least_lag, 0.002);
  EXPECT_EQ(client->Stats().extrapolations, 0u);
  EXPECT_EQ(client->Stats().playout_jumps, 0u);
}

TEST_F(ClientTest, InputsCarryMoveLookAndButtons) {
  Make(1);
  Join();
  Play();
  client->Steer({.force_n = {}, .torque_nm = {}, .move = {3, 4}, .yaw_rad = 7, .pitch_rad = -1, .buttons = 0x80000001});
  ASSERT_TRUE(Until([&] { return !instance->regions[0]->inputs.empty(); }, true));
  const PlayerInput& input = instance->regions[0]->inputs[0];
  EXPECT_NEAR(input.move.x, 0.6, 1e-4);  // cut down to a length of 1
  EXPECT_NEAR(input.move.y, 0.8, 1e-4);
  EXPECT_NEAR(input.yaw_rad, 7 - 2 * 3.14159265, 1e-4);
  EXPECT_NEAR(input.pitch_rad, -1, 1e-4);
  EXPECT_EQ(input.buttons, 0x80000001U);
  EXPECT_EQ(input, AsSent(input));  // predicted as it is read
}

TEST_F(ClientTest, InputsGoToTheOwnerOfTheOwnBody) {
  Make(2);
  Join();
  Play();
  const std::uint32_t first = client->Move({1, 2, 3}, {4, 5, 6});
  ASSERT_TRUE(
      Until([&] { return !instance->regions[0]->inputs.empty() && !instance->regions[1]->inputs.empty(); }, true));
  EXPECT_EQ(instance->regions[0]->inputs[0].number, first);  // to both, while nobody is known to own it
  EXPECT_EQ(instance->regions[0]->inputs[0].force_n, Vec3f(1, 2, 3));
  EXPECT_EQ(instance->regions[0]->inputs[0].torque_nm, Vec3f(4, 5, 6));

  const std::vector<BodyRecord> own = {{client->own_body(), Epoch(1), Moving(0, 0)}};
  Advance([&](Tick t) {
    instance->regions[0]->Snapshot(t, {});
    instance->regions[1]->Snapshot(t, own);
  });
  ASSERT_TRUE(Until([&] { return client->World().contains(client->own_body()); }));
  const std::size_t west = instance->regions[0]->inputs.size(), east = instance->regions[1]->inputs.size();
  const TimePoint from = now;
  while (now - from < std::chrono::seconds(1)) {
    now += std::chrono::milliseconds(5);
    PollOnce();
  }
  ASSERT_TRUE(Until([&] { return instance->regions[1]->inputs.size() >= east + 60; }));
  EXPECT_LE(instance->regions[0]->inputs.size(), west + 8);   // those that were on their way
  EXPECT_LE(instance->regions[1]->inputs.size(), east + 62);  // one a tick, however often it polls
  std::set<std::uint32_t> numbers;
  for (const auto& input : instance->regions[1]->inputs) EXPECT_TRUE(numbers.insert(input.number).second);

  client->Move({}, {});
  for (int i = 0; i < 200; ++i) PollOnce();
  const std::size_t after = instance->regions[1]->inputs.size();
  now += std::chrono::seconds(1);
  for (int i = 0; i < 200; ++i) PollOnce();
  EXPECT_EQ(instance->regions[1]->inputs.size(), after);
}

TEST_F(ClientTest, MovingAForeignBodyComesBackAsAnEvent) {
  Make(1);
  Join();
  Play();
  const std::vector<BodyRecord> ball = {{kBall, Epoch(1), Moving(0, 0)}};
  Advance([&](Tick t) { instance->regions[0]->Snapshot(t, ball); });
  const std::uint32_t number = client->MoveBody(kBall, {1, 0, 0}, {});
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kInputRefused) == 1; }));
  const ClientEvent& refused = *Find(ClientEvent::Kind::kInputRefused);
  EXPECT_EQ(refused.body, kBall);
  EXPECT_EQ(refused.input_number, number);
  EXPECT_EQ(refused.detail, "not yours");
  EXPECT_TRUE(instance->regions[0]->inputs.empty());
  EXPECT_EQ(client->Stats().inputs_refused, 1u);
}

TEST_F(ClientTest, ARegionThatRestartsIsFoundAgain) {
  Make(2);
  Join();
  Play();
  const std::vector<BodyRecord> both = {{kBall, Epoch(1), Moving(0, 0)}, {BodyId(2), Epoch(1), Moving(5, 0)}};
  Advance([&](Tick t) { instance->regions[0]->Snapshot(t, both); });
  ASSERT_EQ(client->World().size(), 2u);
  instance->Restart(0);
  instance->regions[0]->started = true;
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionLost) == 1; }, true));
  EXPECT_EQ(client->World().size(), 2u);
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionBack) == 1; }, true));
  // It comes back with one of the two: the other one is not there any more.
  const std::vector<BodyRecord> one = {{kBall, Epoch(1), Moving(1, 0)}};
  for (int i = 0; i < 70; ++i) Advance([&](Tick t) { instance->regions[0]->Snapshot(t, one); });
  EXPECT_EQ(client->World().size(), 1u);
  EXPECT_TRUE(client->World().contains(kBall));
  EXPECT_EQ(client->state(), ClientState::kPlaying);
  EXPECT_EQ(client->Stats().regions[0].reconnects, 1u);
}

TEST_F(ClientTest, AnAddressThatIsAnothersByNowIsTriedAgain) {
  Make(2);
  Join();
  Play();
  instance->BecomeAnother(0);
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionLost) == 1; }, true));
  ASSERT_TRUE(Until([&] { return instance->regions[0]->logins_refused() >= 2; }, true));
  EXPECT_EQ(client->state(), ClientState::kPlaying);
  instance->Restart(0);
  instance->regions[0]->started = true;
  EXPECT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionBack) == 1; }, true));
}

TEST_F(ClientTest, LearnsThatTheWorldIsPausedAndMakesNoInputsThen) {
  Make(2);
  Join();
  Play();
  const auto tell = [&](bool paused, double pace, std::uint64_t at) {
    for (const auto& region : instance->regions) region->TellClock(paused, pace, Tick(at));
  };
  EXPECT_EQ(client->clock(), (WorldClock{.paused = false, .ticks_per_second = kTickRate}));
  tell(true, kTickRate, 50);
  ASSERT_TRUE(Until([&] { return client->clock().paused; }));
  tell(false, 10, 40);  // from before the pause
  tell(false, 0, 60);   // no pace at all
  tell(false, 20, 60);
  ASSERT_TRUE(Until([&] { return !client->clock().paused; }));
  EXPECT_EQ(client->clock().ticks_per_second, 20);
  EXPECT_EQ(Count(ClientEvent::Kind::kClockChanged), 2) << "all regions say it, and it is one event";
}

TEST_F(ClientTest, FollowsANewMapAndIgnoresAnOlderOne) {
  Make(2);
  Join();
  Play();
  const auto next = [&](std::uint64_t version) {
    const auto cells = instance->map.cells();
    const auto regions = instance->map.regions();
    return *PartitionMap::Create(MapVersion(version), instance->map.bounds(), {cells.begin(), cells.end()},
                                 {regions.begin(), regions.end()});
  };
  instance->regions[0]->TellMap(next(7));
  ASSERT_TRUE(Until([&] { return client->map().version() == MapVersion(7); }));
  instance->regions[0]->TellMap(next(6));
  instance->regions[0]->TellMap(next(8));
  ASSERT_TRUE(Until([&] { return client->map().version() == MapVersion(8); }));
  EXPECT_EQ(Count(ClientEvent::Kind::kMapChanged), 2);
}

// Its region is dead and nobody takes its place: what is shown of the own body is a guess, and says so.
TEST_F(ClientTest, AnOwnBodyThatNobodyHasSpokenOfForASecondIsNotCalledPredicted) {
  Make(1);
  JoinOptions options = Options();
  options.predict = true;
  auto joined = Client::Join(options);
  ASSERT_TRUE(joined.ok()) << joined.status();
  client = *std::move(joined);
  Play();
  const std::vector<BodyRecord> own = {{client->own_body(), Epoch(1), Moving(3, 1)}};
  for (int i = 0; i < 20; ++i) {
    client->Move({1, 0, 0}, {});
    Advance([&](Tick at) { instance->regions[0]->Snapshot(at, own); });
    (void)client->Interpolated(now);
  }
  ASSERT_EQ(client->Interpolated(now).size(), 1u);
  EXPECT_TRUE(client->Interpolated(now)[0].predicted);
  for (int i = 0; i < 80; ++i) {
    now += kTick;
    PollOnce();
    (void)client->Interpolated(now);
  }
  EXPECT_FALSE(client->Interpolated(now)[0].predicted);
  EXPECT_TRUE(client->Interpolated(now)[0].extrapolated);
}

}  // namespace
}  // namespace tessera::client
