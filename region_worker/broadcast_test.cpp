// The broadcasts to clients, over real connections, of a region in the same process.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/region.h"
#include "core/replication/datagram.h"
#include "core/replication/input.h"
#include "core/replication/movement_news.h"
#include "core/replication/snapshot.h"
#include "game_sdk/api/api.h"
#include "net/testing/endpoint_pair.h"
#include "region_worker/game_port.h"
#include "region_worker/pair_broadcast.h"
#include "region_worker/snapshot_broadcast.h"
#include "region_worker/worker_metrics.h"
#include "telemetry/log_throttle.h"
#include "telemetry/testing/captured_log.h"

namespace tessera::worker {
namespace {

constexpr std::uint64_t kBall = 1, kNearTrigger = 2, kFarBall = 3, kFarTrigger = 4;

BodyDef Ball(std::uint64_t id, Vec3d place, double radius_m, bool trigger) {
  BodyDef def;
  def.id = BodyId(id);
  def.shape = std::make_shared<const Shape>(Shape{SphereShape{radius_m}});
  def.initial.position = place;
  def.trigger = trigger;
  if (trigger) def.motion = Motion::kStatic;
  return def;
}

// Two balls at rest, each in a trigger: one pair 3 m from where the player stands, the other 20 m away.
std::shared_ptr<const Scene> TwoTriggers() {
  Scene scene;
  scene.bounds = {{-20, -20, -20}, {20, 20, 20}};
  scene.gravity_m_s2 = {};
  scene.bodies = {Ball(kBall, {-5, 0, -2}, 0.5, false), Ball(kNearTrigger, {-5, 0, -2}, 1, true),
                  Ball(kFarBall, {10, 0, 10}, 0.5, false), Ball(kFarTrigger, {10, 0, 10}, 1, true)};
  PlayerRules& rules = scene.player.emplace();
  rules.body.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  rules.spawn_points = {{-5, 0, -5}};
  rules.max_force_n = 20;
  rules.max_speed_m_s = 5;
  return std::make_shared<const Scene>(std::move(scene));
}

struct Connected {
  std::unique_ptr<net::Endpoint> endpoint = net::Listen();
  net::PeerHandle peer;
  std::vector<v1::PairEvents> pairs;
  std::vector<net::Bytes> snapshots;
  bool welcomed = false;
};

class BroadcastTest : public testing::Test {
 protected:
  BroadcastTest() {
    port_.Open({.self = net::TestIdentity(),
                .tick_rate_hz = scene_->tick_rate_hz,
                .snapshot_rate_hz = scene_->tick_rate_hz,
                .map = {}},
               [](PlayerNumber, net::Generation) { return Admission::kWelcome; });
    region_.SpawnPlayer(PlayerNumber(1));
    region_.Start();
    result_ = region_.Step();
  }

  std::unique_ptr<Connected> Join() {
    auto client = std::make_unique<Connected>();
    client->peer = *net::Dial(*client->endpoint, port_.port(), 1);
    EXPECT_TRUE(Until(*client, [&] { return client->welcomed; }));
    return client;
  }

  void Exchange(Connected& client) {
    for (const auto& [from, bytes] : port_.Service(Clock::now(), region_.tick(), true).acknowledgements) {
      snapshots_.Acknowledge(from, bytes);
      ++acknowledged_;
    }
    for (const net::Event& event : client.endpoint->Service(std::chrono::milliseconds(1))) {
      if (event.kind == net::Event::Kind::kMessage) Take(client, event);
    }
  }
  bool Until(Connected& client, const std::function<bool()>& done) {
    for (const auto limit = Clock::now() + net::kPatience; Clock::now() < limit && !done();) Exchange(client);
    return done();
  }

  static void Take(Connected& client, const net::Event& event) {
    if (event.delivery == net::Delivery::kUnsequenced) return client.snapshots.push_back(event.bytes);
    v1::RegionControl control;
    ASSERT_TRUE(control.ParseFromArray(event.bytes.data(), static_cast<int>(event.bytes.size())));
    client.welcomed = client.welcomed || control.has_welcome();
    if (control.has_pair_events()) client.pairs.push_back(control.pair_events());
  }

  const std::shared_ptr<const Scene> scene_ = TwoTriggers();
  region::Region region_{{.self = RegionId(1),
                          .incarnation = Incarnation(1),
                          .scene = scene_,
                          .map = *MakeGridMap(scene_->ground(), 1),
                          .settings = {}}};
  region::StepResult result_;
  WorkerMetrics metrics_;
  GamePort port_{*net::Endpoint::Create({.bind_address = "127.0.0.1", .port = 0}), metrics_};
  SnapshotBroadcast snapshots_{RegionId(1), *scene_, scene_->tick_rate_hz, {}, metrics_};
  int acknowledged_ = 0;
};

TEST_F(BroadcastTest, AConnectionFirstGetsAllPairsInItsReachAndThenChangesAlone) {
  PairBroadcast pairs(5);
  const auto first = Join();
  pairs.AfterTick(region_, result_.events, nullptr, port_);
  ASSERT_TRUE(Until(*first, [&] { return !first->pairs.empty(); }));
  EXPECT_TRUE(first->pairs[0].whole());
  ASSERT_EQ(first->pairs[0].events_size(), 1) << first->pairs[0].DebugString();
  EXPECT_EQ(first->pairs[0].events(0).body_a(), kBall);
  EXPECT_EQ(first->pairs[0].events(0).body_b(), kNearTrigger);

  pairs.AfterTick(region_, {}, nullptr, port_);
  const physics::PairEvent end{
      .body_a = BodyId(kBall), .body_b = BodyId(kNearTrigger), .trigger = true, .begin = false};
  pairs.AfterTick(region_, {&end, 1}, nullptr, port_);
  ASSERT_TRUE(Until(*first, [&] { return first->pairs.size() == 2; }));
  EXPECT_FALSE(first->pairs[1].whole());
  EXPECT_FALSE(first->pairs[1].events(0).begin());

  const auto second = Join();  // takes the place of the first
  pairs.AfterTick(region_, {}, nullptr, port_);
  ASSERT_TRUE(Until(*second, [&] { return !second->pairs.empty(); }));
  EXPECT_TRUE(second->pairs[0].whole());
}

// A player may come back as often as it likes; what is logged of it may not grow with that.
TEST_F(BroadcastTest, OneWhoComesBackAgainAndAgainFillsNoLog) {
  const telemetry::CapturedLog log;
  constexpr std::size_t kTimes = 60;
  const auto begun = Clock::now();
  std::unique_ptr<Connected> last;
  for (std::size_t i = 0; i < kTimes; ++i) last = Join();
  const auto seconds = static_cast<std::size_t>(std::chrono::ceil<std::chrono::seconds>(Clock::now() - begun).count());
  const auto lines = log.LinesWith("client welcome");
  ASSERT_FALSE(lines.empty());
  EXPECT_EQ(lines.front().find("info client welcome player=1 from=127.0.0.1"), 0U) << lines.front();
  EXPECT_LE(lines.size(), std::min(kTimes, seconds * telemetry::LogThrottle::kLinesPerSecond));
}

TEST_F(BroadcastTest, EachConnectionHasASenderOfItsOwn) {
  const auto tick = [&] {
    result_ = region_.Step();
    snapshots_.AfterTick(region_, result_.departures, nullptr, port_);
  };
  const auto first = Join();
  tick();
  ASSERT_TRUE(Until(*first, [&] { return !first->snapshots.empty(); }));
  replication::SnapshotReceiver receiver(scene_->bounds, {});
  const auto read = receiver.Read(first->snapshots[0]);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->full_records, 3u);  // two balls and the player's body

  ASSERT_TRUE(first->endpoint
                  ->Send(first->peer, net::Delivery::kUnsequenced,
                         replication::EncodeInput({.ack = receiver.WriteAck(), .inputs = {}}))
                  .ok());
  ASSERT_TRUE(Until(*first, [&] { return acknowledged_ == 1; }));
  for (int i = 0; i < 5; ++i) tick();
  for (int i = 0; i < 5; ++i) Exchange(*first);
  EXPECT_EQ(first->snapshots.size(), 1u) << "all is acknowledged and at rest";

  const auto second = Join();
  tick();
  ASSERT_TRUE(Until(*second, [&] { return !second->snapshots.empty(); }));
  replication::SnapshotReceiver anew(scene_->bounds, {});
  const auto again = anew.Read(second->snapshots[0]);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->full_records, 3u);
}

// It lets its body go where it goes, and counts its calls.
constexpr tessera_movement kCoast = {sizeof kCoast,
                                     TESSERA_MOVEMENT_ABI,
                                     "coast",
                                     7,
                                     1,
                                     nullptr,
                                     [](const tessera_movement_tick*, void* state, tessera_movement_push*) {
                                       ++*static_cast<std::uint8_t*>(state);
                                       return 0;
                                     },
                                     nullptr};

// A player who moves a ball that lies on the floor and rolls into another one; two others touch elsewhere.
class ControlledPairsTest : public testing::Test {
 protected:
  static constexpr std::uint64_t kMoved = 1, kFloor = 2, kHit = 3;

  ControlledPairsTest() {
    Scene scene;
    scene.bounds = {{-20, -20, -20}, {20, 20, 20}};
    scene.bodies = {Ball(kMoved, {0, 0, 0}, 0.5, false), Ball(kFloor, {0, -1, 0}, 0.5, false),
                    Ball(kHit, {0, 0, 1.5}, 0.5, false), Ball(4, {0, 0, -8}, 0.5, false),
                    Ball(5, {0, 0, -6.5}, 0.5, false)};
    scene.bodies[1].shape = std::make_shared<const Shape>(Shape{BoxShape{{15, 0.5, 15}}});
    scene.bodies[1].motion = Motion::kStatic;
    for (const std::size_t i : {0, 3}) scene.bodies[i].initial.linear_velocity = {0, 0, 2};
    for (BodyDef& def : scene.bodies) def.may_sleep = false;
    PlayerRules& rules = scene.player.emplace();
    rules.body.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
    rules.spawn_points = {{-5, 0, -5}};
    rules.max_force_n = 20;
    rules.max_speed_m_s = 5;
    scene_ = std::make_shared<const Scene>(std::move(scene));
    game_.On(game::kOnJoin, "", [](game::GameCalls& calls, game::ScriptedGame::Arguments arguments) {
      const game::GameValue player{PlayerNumber(static_cast<std::uint32_t>(arguments[0].as.id))};
      EXPECT_TRUE(calls.Call(game::kPlayerControl, {player, BodyId(kMoved)})) << calls.error();
      return true;
    });
    module_ = game_.module();
    module_.movement = &kCoast;
    auto host = game::GameHost::Load(module_, {"game.lua", "fine"}, scene_);
    EXPECT_TRUE(host.ok()) << host.status();
    region::Config config{RegionId(1), Incarnation(1), scene_, *MakeGridMap(scene_->ground(), 1), {}, nullptr};
    config.game = *std::move(host);
    region_ = std::make_unique<region::Region>(std::move(config));
    region_->SpawnPlayer(PlayerNumber(1));
    region_->Start();
    port_.Open({.self = net::TestIdentity(),
                .tick_rate_hz = scene_->tick_rate_hz,
                .snapshot_rate_hz = scene_->tick_rate_hz,
                .map = {}},
               [](PlayerNumber, net::Generation) { return Admission::kWelcome; });
    region_->Step();
    peer_ = *net::Dial(*endpoint_, port_.port(), 1);
    EXPECT_TRUE(Until([&] { return !port_.clients().empty(); }));
  }
  bool Until(const std::function<bool()>& done) {
    for (const auto limit = Clock::now() + net::kPatience; Clock::now() < limit && !done();) {
      port_.Service(Clock::now(), region_->tick(), true);
      for (const net::Event& event : endpoint_->Service(std::chrono::milliseconds(1))) {
        v1::RegionControl control;
        if (event.kind != net::Event::Kind::kMessage) continue;
        if (event.delivery == net::Delivery::kUnsequenced) {
          if (auto news = replication::DecodeMovementNews(event.bytes); news.ok()) movements_.push_back(*news);
          continue;
        }
        EXPECT_TRUE(control.ParseFromArray(event.bytes.data(), static_cast<int>(event.bytes.size())));
        for (const v1::PairEvent& pair : control.pair_events().events()) seen_.push_back(pair);
      }
    }
    return done();
  }
  bool Saw(std::uint64_t a, std::uint64_t b, bool begin) const {
    return std::ranges::any_of(seen_, [&](const v1::PairEvent& pair) {
      return pair.body_a() == a && pair.body_b() == b && pair.begin() == begin;
    });
  }

  std::shared_ptr<const Scene> scene_;
  game::ScriptedGame game_;
  tessera_game_module module_{};
  std::unique_ptr<region::Region> region_;
  WorkerMetrics metrics_;
  GamePort port_{*net::Endpoint::Create({.bind_address = "127.0.0.1", .port = 0}), metrics_};
  std::unique_ptr<net::Endpoint> endpoint_ = net::Listen();
  net::PeerHandle peer_;
  std::vector<v1::PairEvent> seen_;
  std::vector<replication::MovementNews> movements_;
};

// With each snapshot the player gets the state that the movement left for the last input.
TEST_F(ControlledPairsTest, NewsOfTheMovementGoToItsPlayer) {
  const replication::SnapshotSettings settings = replication::SnapshotSettingsFor(*scene_);
  SnapshotBroadcast snapshots(RegionId(1), *scene_, scene_->tick_rate_hz, settings, metrics_);
  std::map<Tick, MovementState> states;
  for (int i = 0; i < 20; ++i) {
    const region::StepResult result = region_->Step();
    snapshots.AfterTick(*region_, result.departures, nullptr, port_);
    const auto moved = region_->MovementOf(PlayerNumber(1));
    ASSERT_TRUE(moved.has_value());
    states[region_->tick()] = moved->state;
  }
  ASSERT_TRUE(Until([&] { return movements_.size() >= 20; }));
  for (const replication::MovementNews& news : movements_) {
    EXPECT_EQ(news.name, "coast");
    EXPECT_EQ(news.state, states.at(news.tick));
  }
  EXPECT_EQ(movements_.back().state.body, BodyId(kMoved));
  EXPECT_GT(movements_.back().state.bytes[0], 10);
}

TEST_F(ControlledPairsTest, GoToThePlayerWhoMovesTheBody) {
  PairBroadcast pairs(5);
  bool moved = false, hit = false, others = false;
  for (int i = 0; i < 60; ++i) {
    const region::StepResult result = region_->Step();
    pairs.AfterTick(*region_, result.events, nullptr, port_);
    moved = moved || region_->MovedBy(PlayerNumber(1)) == BodyId(kMoved);
    for (const physics::PairEvent& event : result.events) {
      hit = hit || (event.begin && event.body_a == BodyId(kMoved) && event.body_b == BodyId(kHit));
      others = others || (event.begin && event.body_a == BodyId(4) && event.body_b == BodyId(5));
    }
  }
  ASSERT_TRUE(moved && hit && others);
  ASSERT_TRUE(Until([&] { return Saw(kMoved, kHit, true); }));
  const auto met =
      std::ranges::find_if(seen_, [](const v1::PairEvent& pair) { return pair.body_b() == kHit && pair.begin(); });
  EXPECT_TRUE(met->has_contact() && met->contact().impulse() > 0) << met->DebugString();
  EXPECT_TRUE(Saw(kMoved, kFloor, true)) << "it lay there before the player had it";
  EXPECT_FALSE(Saw(4, 5, true) || Saw(kFloor, kHit, true)) << "nobody moves one of them";
}

}  // namespace
}  // namespace tessera::worker
