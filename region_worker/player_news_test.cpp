// The client of a player is sent what the game tells that player; nobody is shown the rest.
#include "region_worker/player_news.h"

#include <gmock/gmock.h>

#include <set>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/replication/snapshot.h"
#include "game_sdk/api/api.h"
#include "region_worker/body_feed.h"

namespace tessera::worker {
namespace {

using game::GameCalls;
using ::testing::ElementsAre;

constexpr PlayerNumber kAda{1};
constexpr BodyId kAdasBody = PlayerBodyId(kAda);

constexpr BodyId kCar{1};

std::shared_ptr<const Scene> AdasWorld() {
  auto scene = std::make_shared<Scene>();
  scene->bounds = {{-50, -50, -50}, {50, 50, 50}};
  scene->gravity_m_s2 = {};
  scene->kinds = {""};
  PlayerRules& player = scene->player.emplace();
  player.body.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  player.spawn_points = {{5, 0, 0}};
  player.max_speed_m_s = 1;
  BodyDef car;
  car.id = kCar;
  car.shape = player.body.shape;
  car.initial.position = {-5, 0, 0};
  scene->bodies.push_back(car);
  return scene;
}

class PlayerNewsTest : public ::testing::Test {
 protected:
  PlayerNewsTest() {
    game_.On(game::kOnTick, "", [this](GameCalls& calls, game::ScriptedGame::Arguments) {
      if (next_ == 0) return true;
      EXPECT_TRUE(calls.Call(next_, arguments_)) << calls.error();
      next_ = 0;
      return true;
    });
    module_ = game_.module();
    region::Config config{RegionId(1), Incarnation(1), scene_, *MakeGridMap(scene_->ground(), 1), {}};
    config.game = *game::GameHost::Load(module_, {"game.lua", "fine"}, scene_);
    region_.emplace(std::move(config));
    region_->Start();
    region_->SpawnPlayer(kAda, "ada");
    Tick();
  }
  void Tick() {
    const region::StepResult result = region_->Step();
    feed_.Note(result.tick, result.departures);
    feed_.Push(*region_, history_);
    for (const replication::Bytes& datagram : sender_.Write(history_, 0, 0).datagrams) {
      const auto read = receiver_.Read(datagram);
      ASSERT_TRUE(read.ok()) << read.status();
      for (const replication::BodyRecord& body : read->bodies) seen_.insert(body.id);
      for (const replication::DepartureRecord& departure : read->departures) seen_.erase(departure.id);
    }
    ASSERT_TRUE(sender_.Acknowledge(receiver_.WriteAck()).ok());
  }
  // In the next tick.
  void Act(std::uint32_t function, std::vector<game::GameValue> arguments) {
    next_ = function;
    arguments_ = std::move(arguments);
    Tick();
  }
  void Do(std::uint32_t function, std::vector<game::GameValue> arguments) {
    arguments.insert(arguments.begin(), game::GameValue(kAda));
    Act(function, std::move(arguments));
  }
  std::optional<v1::RegionControl> News() { return NewsFor(*region_, kAda, sent_); }
  static std::vector<std::string> EventsOf(const std::optional<v1::RegionControl>& message) {
    std::vector<std::string> names;
    for (const v1::GameEvent& event : message->player_news().events()) names.push_back(event.name());
    return names;
  }

  const std::shared_ptr<const Scene> scene_ = AdasWorld();
  game::ScriptedGame game_;
  tessera_game_module module_{};
  std::uint32_t next_ = 0;
  std::vector<game::GameValue> arguments_;
  std::optional<region::Region> region_;
  BodyFeed feed_;
  replication::SnapshotHistory history_{scene_->bounds, {}};
  replication::SnapshotSender sender_{{}};
  replication::SnapshotReceiver receiver_{scene_->bounds, {}};
  std::set<BodyId> seen_;
  std::optional<SentNews> sent_;
};

TEST_F(PlayerNewsTest, AConnectionIsSentWhatIsNewToIt) {
  ASSERT_TRUE(News().has_value()) << "the first word says where numbers begin";
  EXPECT_FALSE(News().has_value());
  Do(game::kPlayerSend, {std::string("a")});
  Do(game::kPlayerSend, {std::string("b")});
  std::optional<v1::RegionControl> news = News();
  EXPECT_THAT(EventsOf(news), ElementsAre("a", "b"));
  EXPECT_EQ(news->player_news().last_event(), 2U);
  EXPECT_EQ(news->player_news().epoch(), 1U);
  Do(game::kPlayerSend, {std::string("c")});
  EXPECT_THAT(EventsOf(News()), ElementsAre("c"));
  std::optional<SentNews> another;
  EXPECT_THAT(EventsOf(NewsFor(*region_, kAda, another)), ElementsAre("a", "b", "c")) << "nobody said to have them";
  region_->AcknowledgeEvents(kAda, 2);
  Tick();
  another.reset();
  EXPECT_THAT(EventsOf(NewsFor(*region_, kAda, another)), ElementsAre("c"));
}

TEST_F(PlayerNewsTest, ACommandIsAcknowledgedWhenTheStandbyHasIt) {
  region_->SetStandby(true);
  Tick();
  region_->LogAcknowledged(region_->tick());
  Tick();
  (void)News();
  ASSERT_TRUE(region_->TakeCommand(kAda, {1, 1, "jump"}).ok());
  Tick();
  EXPECT_FALSE(News().has_value());
  region_->LogAcknowledged(region_->tick());
  Tick();
  const std::optional<v1::RegionControl> news = News();
  ASSERT_TRUE(news.has_value());
  EXPECT_EQ(news->player_news().last_command(), 1U);
}

TEST_F(PlayerNewsTest, TheEndOfASessionIsSaidOnce) {
  Do(game::kPlayerKick, {std::string("idle")});
  const std::optional<v1::RegionControl> news = News();
  ASSERT_TRUE(news.has_value());
  EXPECT_EQ(news->session_ended().reason(), "idle");
  EXPECT_FALSE(News().has_value());
}

TEST_F(PlayerNewsTest, ASpectatorIsSeenByNobodyUntilItComesBack) {
  EXPECT_THAT(seen_, ElementsAre(kCar, kAdasBody));
  (void)News();
  Do(game::kPlayerSpectate, {Vec3d{1, 20, 3}});
  EXPECT_THAT(seen_, ElementsAre(kCar));
  const std::optional<v1::RegionControl> news = News();
  ASSERT_TRUE(news.has_value());
  EXPECT_TRUE(news->player_news().spectating());
  EXPECT_EQ(news->player_news().view_y(), 20);
  for (int i = 0; i < 5; ++i) Tick();
  EXPECT_THAT(seen_, ElementsAre(kCar));
  Do(game::kPlayerRespawn, {Vec3d{1, 1, 1}});
  Tick();
  EXPECT_THAT(seen_, ElementsAre(kCar, kAdasBody));
  EXPECT_FALSE(News()->player_news().spectating());
}

TEST_F(PlayerNewsTest, WhoMovesAnotherBodyIsToldWhichAndIsNotSeen) {
  (void)News();
  Do(game::kPlayerControl, {kCar});
  EXPECT_FALSE(News().has_value()) << "not yet";
  Tick();
  Tick();
  const std::optional<v1::RegionControl> news = News();
  ASSERT_TRUE(news.has_value());
  EXPECT_EQ(news->player_news().controlled_body(), kCar.value());
  EXPECT_FALSE(news->player_news().spectating());
  EXPECT_THAT(seen_, ElementsAre(kCar));
  EXPECT_EQ(region_->MovedBy(kAda), kCar);
  Do(game::kPlayerRespawn, {Vec3d{1, 1, 1}});
  EXPECT_EQ(News()->player_news().controlled_body(), 0U);
}

TEST_F(PlayerNewsTest, WhatHangsTogetherWithThePlayerIsToldUntilItIsParted) {
  (void)News();
  Act(game::kBodyConnect, {kAdasBody, kCar});
  std::optional<v1::RegionControl> news = News();
  ASSERT_TRUE(news.has_value());
  const auto read = [&] {
    const std::string& bytes = news->player_news().joints();
    return *game::DecodeJoints({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  };
  const std::vector<game::JointOfBody> joints = read();
  ASSERT_EQ(joints.size(), 1U);
  EXPECT_EQ(joints[0].body, kCar) << "the lower one has it";
  EXPECT_EQ(joints[0].joint.other, kAdasBody);
  EXPECT_EQ(joints[0].joint.kind, game::GameJointKind::kBall);
  Tick();
  EXPECT_FALSE(News().has_value()) << "once";
  Act(game::kBodyDisconnect, {kAdasBody, kCar});
  news = News();
  ASSERT_TRUE(news.has_value());
  EXPECT_TRUE(read().empty());
}

// A player who may not see a body is not told that it hangs there.
TEST_F(PlayerNewsTest, AJointWithAHiddenBodyIsNotTold) {
  (void)News();
  Act(game::kBodyShowTo, {kCar, std::string("servers")});
  Act(game::kBodyConnect, {kAdasBody, kCar});
  Tick();
  const std::optional<v1::RegionControl> news = News();
  EXPECT_TRUE(!news.has_value() || news->player_news().joints().empty());
}

TEST_F(PlayerNewsTest, LimitsOfTheGameAreTold) {
  (void)News();
  game_.On(game::kOnTick, "", [](GameCalls& calls, game::ScriptedGame::Arguments) {
    const game::GameValue speed{2.5};
    const tessera_game_field field{"speed", 5, game::ToInterface(speed)};
    tessera_game_value table{};
    table.type = TESSERA_GAME_FIELDS;
    table.count = 1;
    table.as.fields = &field;
    const tessera_game_value arguments[] = {game::ToInterface(game::GameValue(kAda)), table};
    return calls.CallRaw(game::kPlayerSetLimits, arguments);
  });
  Tick();
  const std::optional<v1::RegionControl> news = News();
  ASSERT_TRUE(news.has_value() && news->player_news().has_limits());
  EXPECT_EQ(news->player_news().limits().speed_m_s(), 2.5F);
  EXPECT_FALSE(news->player_news().limits().has_force_n());
  EXPECT_EQ(news->player_news().limits().axis_y(), 1);
}

}  // namespace
}  // namespace tessera::worker
