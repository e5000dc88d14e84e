// Players who move other bodies than their own: in one region, over borders, and through the death of a region.
#include <gmock/gmock.h>

#include <functional>
#include <map>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/log.h"
#include "core/region/region.h"
#include "core/region/region_state.h"
#include "core/region/standby_copy.h"
#include "core/region/testing/carry_on.h"
#include "core/region/testing/small_world.h"
#include "core/world/partition_change.h"
#include "game_sdk/api/api.h"

namespace tessera::region::control {
namespace {

using game::GameCalls;
using game::GameHost;
using game::GameValue;
using game::PlayerStage;
using game::ScriptedGame;
using Arguments = ScriptedGame::Arguments;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr PlayerNumber kAda{1}, kBob{2};
constexpr BodyId kCar{1}, kOther{2};
constexpr double kNewtons = 6;

// Two regions side by side, whose border is x = 0, and two players who begin in region 1 unless told otherwise.
class RegionControlTest : public ::testing::Test {
 protected:
  void Begin(const std::vector<Vec3d>& places, Vec3f velocity = {}) {
    Scene scene = Balls(places);
    scene.kinds = {"", "car"};
    for (BodyDef& def : scene.bodies) {
      def.kind = 1;
      def.may_sleep = false;
      def.initial.linear_velocity = velocity;
    }
    AllowPlayers(scene);
    scene.player->max_speed_m_s = 1e12;  // a force fades with the speed
    scene.player->spawn_points = {{-5, 0, -5}, {-7, 0, -5}};
    scene_ = std::make_shared<const Scene>(std::move(scene));
    game.On(game::kOnControl, "", [this](GameCalls&, Arguments arguments) {
      const auto player = std::to_string(arguments[0].as.id);
      const bool none = arguments[1].type == TESSERA_GAME_NOTHING;
      news.push_back(player + (none ? ": " + std::string(arguments[2].as.text, arguments[2].count)
                                    : " moves " + std::to_string(arguments[1].as.id)));
      return true;
    });
    // Each is done once, in the region that owns the player's body.
    game.On(game::kOnTick, "", [this](GameCalls& calls, Arguments) {
      for (const PlayerNumber player : {kAda, kBob}) {
        if (!orders_.contains(player)) continue;
        EXPECT_TRUE(calls.Call(game::kPlayerIsOwn, {player}));
        if (calls.result().as.whole == 0) continue;
        const std::function<bool(GameCalls&)> order = std::move(orders_.at(player));
        orders_.erase(player);
        EXPECT_TRUE(order(calls)) << calls.error();
      }
      return true;
    });
    module_ = game.module();
    one = Make(kOne, nullptr);
    two = Make(kTwo, nullptr);
    Send(kOne, one->Start());
    Send(kTwo, two->Start());
    one->SpawnPlayer(kAda, "ada");
    one->SpawnPlayer(kBob, "bob");
  }
  std::unique_ptr<Region> Make(RegionId self, std::shared_ptr<const RegionState> initial) {
    auto host = GameHost::Load(module_, {"game.lua", "fine"}, scene_);
    EXPECT_TRUE(host.ok()) << host.status();
    Config config{self, Incarnation(self.value()), scene_, *MakeGridMap(scene_->ground(), 2), {}, std::move(initial)};
    config.game = *std::move(host);
    return std::make_unique<Region>(std::move(config));
  }
  void Send(RegionId from, const std::vector<OutgoingFrame>& frames) {
    for (const OutgoingFrame& frame : frames) {
      const absl::Status status = (from == kOne ? two : one)->Receive(from, frame.bytes);
      ASSERT_TRUE(status.ok()) << status;
    }
  }
  void Step() {
    ASSERT_TRUE(one->CanStep() && two->CanStep());
    const StepResult first = one->Step(), second = two->Step();
    Send(kOne, first.frames);
    Send(kTwo, second.frames);
    log_of_two = second.log;
  }
  void Steps(int count) {
    for (int i = 0; i < count; ++i) ASSERT_NO_FATAL_FAILURE(Step());
  }
  void Order(PlayerNumber player, std::function<bool(GameCalls&)> order) { orders_[player] = std::move(order); }
  void Control(PlayerNumber player, BodyId body) {
    Order(player, [=](GameCalls& calls) { return calls.Call(game::kPlayerControl, {player, body}); });
  }
  // One input a step, each with a push along x.
  void Push(PlayerNumber player, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      PlayerInput input;
      input.number = ++inputs_[player];
      input.player = player;
      input.body = PlayerBodyId(player);
      input.force_n = {static_cast<float>(kNewtons), 0, 0};
      const absl::Status status = OwnerOf(PlayerBodyId(player)).QueueInput(input);
      ASSERT_TRUE(status.ok()) << status;
      ASSERT_NO_FATAL_FAILURE(Step());
    }
  }
  Region& OwnerOf(BodyId id) { return one->Owns(id) ? *one : *two; }
  BodyState StateOf(BodyId id) { return OwnerOf(id).world().StateOf(id); }
  const game::GameRecord& RecordOf(BodyId id) {
    static const game::GameRecord kEmpty;
    const KeptRecord* record = OwnerOf(id).records().Find(id);
    return record == nullptr ? kEmpty : record->game;
  }
  bool SameOwner(BodyId a, BodyId b) { return one->Owns(a) == one->Owns(b) && two->Owns(a) == two->Owns(b); }
  void ExpectMoves(PlayerNumber player, BodyId body) {
    EXPECT_EQ(RecordOf(PlayerBodyId(player)).player->driven(), body);
    EXPECT_EQ(RecordOf(body).driver, player);
    EXPECT_EQ(RecordOf(body).driver_until, Tick());
    EXPECT_TRUE(SameOwner(PlayerBodyId(player), body));
    EXPECT_EQ(OwnerOf(body).MovedBy(player), body);
    EXPECT_TRUE(OwnerOf(body).IsHidden(PlayerBodyId(player)));
    EXPECT_LT(Length(StateOf(PlayerBodyId(player)).position - StateOf(body).position), 1e-9);
  }

  ScriptedGame game;
  std::unique_ptr<Region> one, two;
  std::vector<std::string> news;
  Bytes log_of_two;

 private:
  std::shared_ptr<const Scene> scene_;
  tessera_game_module module_{};
  std::map<PlayerNumber, std::function<bool(GameCalls&)>> orders_;
  std::map<PlayerNumber, std::uint32_t> inputs_;
};

TEST_F(RegionControlTest, InputsMoveTheOtherBodyAndTheOwnOneGoesAlong) {
  Begin({{-8, 0, 5}});
  Steps(2);
  Control(kAda, kCar);
  Steps(4);
  EXPECT_THAT(news, ElementsAre("1 moves 1"));
  ExpectMoves(kAda, kCar);
  ASSERT_NO_FATAL_FAILURE(Push(kAda, 20));
  Steps(3);
  EXPECT_NEAR(StateOf(kCar).linear_velocity.x, 20 * kNewtons / 60, 1e-4) << "each input pushes once";
  EXPECT_EQ(OwnerOf(kCar).LastInput(kAda), 20U);
  ExpectMoves(kAda, kCar);
  EXPECT_TRUE(one->world().IsParked(PlayerBodyId(kAda)));
}

TEST_F(RegionControlTest, ABodyOfAnotherRegionIsReached) {
  Begin({{7, 0, 5}});
  Steps(2);
  Control(kAda, kCar);
  Steps(20);
  EXPECT_THAT(news, ElementsAre("1 moves 1"));
  ASSERT_TRUE(two->Owns(kCar));
  ExpectMoves(kAda, kCar);
  ASSERT_NO_FATAL_FAILURE(Push(kAda, 10));
  Steps(3);
  EXPECT_NEAR(StateOf(kCar).linear_velocity.x, 10 * kNewtons / 60, 1e-4);
}

TEST_F(RegionControlTest, BothAreHandedOverTogetherAndNoInputIsLost) {
  Begin({{-1.5, 0, 5}}, {3, 0, 0});
  Steps(2);
  Control(kAda, kCar);
  Steps(4);
  ASSERT_TRUE(one->Owns(kCar));
  for (int i = 0; i < 60; ++i) {
    ASSERT_NO_FATAL_FAILURE(Push(kAda, 1));
    ASSERT_TRUE(SameOwner(kCar, PlayerBodyId(kAda)));
  }
  Steps(6);
  ASSERT_TRUE(two->Owns(kCar));
  EXPECT_NEAR(StateOf(kCar).linear_velocity.x, 3 + 60 * kNewtons / 60, 1e-4);
  ExpectMoves(kAda, kCar);
  EXPECT_THAT(news, ElementsAre("1 moves 1")) << "nobody is told of a handover";
}

TEST_F(RegionControlTest, ANeighbourStepsTheMovedBodyAlike) {
  Begin({{-0.8, 0, 5}});
  Steps(2);
  Control(kAda, kCar);
  Steps(6);
  for (int i = 0; i < 12; ++i) {
    ASSERT_NO_FATAL_FAILURE(Push(kAda, 1));
    ASSERT_TRUE(two->world().Has(kCar));
    EXPECT_EQ(one->world().StateOf(kCar), two->world().StateOf(kCar)) << i;
    EXPECT_FALSE(two->world().Has(PlayerBodyId(kAda))) << "nobody sees the own body";
  }
}

TEST_F(RegionControlTest, OfTwoWhoAskTheFirstGetsTheBodyAndTheOtherTheReason) {
  for (const double x : {-8.0, 7.0}) {
    news.clear();
    Begin({{x, 0, 5}});
    Steps(2);
    Control(kBob, kCar);
    Control(kAda, kCar);
    Steps(20);
    EXPECT_THAT(news, ::testing::UnorderedElementsAre("1 moves 1", "2: body 1 is moved by player 1"));
    ExpectMoves(kAda, kCar);
    EXPECT_EQ(RecordOf(PlayerBodyId(kBob)).player->stage, PlayerStage::kPlaying) << "as before";
    EXPECT_EQ(RecordOf(PlayerBodyId(kBob)).player->controls, BodyId());
  }
}

// A client names the body that its input is for. It is believed only about its own, whatever moves beside it.
TEST_F(RegionControlTest, AnInputForAnothersBodyIsRefusedByNameAndMovesNothing) {
  Begin({{-8, 0, 5}});
  Steps(2);
  Control(kAda, kCar);
  Steps(4);
  ExpectMoves(kAda, kCar);
  std::uint32_t number = 0;
  for (const BodyId body : {kCar, PlayerBodyId(kAda)}) {
    PlayerInput input;
    input.number = ++number;
    input.player = kBob;
    input.body = body;
    input.force_n = {static_cast<float>(kNewtons), 0, 0};
    const absl::Status status = one->QueueInput(input);
    EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied);
    EXPECT_EQ(status.message(), "body " + std::to_string(body.value()) + " is not player 2's");
  }
  Steps(10);
  EXPECT_EQ(StateOf(kCar).linear_velocity, Vec3f());
  EXPECT_EQ(StateOf(PlayerBodyId(kBob)).linear_velocity, Vec3f());
  ExpectMoves(kAda, kCar);
  Push(kAda, 5);
  Steps(3);
  EXPECT_NEAR(StateOf(kCar).linear_velocity.x, 5 * kNewtons / 60, 1e-4) << "whoever moves it is not disturbed";
}

TEST_F(RegionControlTest, ABodyLetGoInTheSameTickIsTaken) {
  Begin({{-8, 0, 5}});
  Steps(2);
  Control(kAda, kCar);
  Steps(4);
  Order(kAda, [](GameCalls& calls) { return calls.Call(game::kPlayerRespawn, {kAda, Vec3d{-3, 0, 0}}); });
  Control(kBob, kCar);
  Steps(4);
  EXPECT_THAT(news, ElementsAre("1 moves 1", "2 moves 1"));
  ExpectMoves(kBob, kCar);
  EXPECT_EQ(RecordOf(PlayerBodyId(kAda)).player->stage, PlayerStage::kPlaying);
  EXPECT_FALSE(one->world().IsParked(PlayerBodyId(kAda)));
  EXPECT_EQ(one->MovedBy(kAda), PlayerBodyId(kAda));
  ASSERT_NO_FATAL_FAILURE(Push(kAda, 6));
  Steps(2);
  EXPECT_NEAR(StateOf(PlayerBodyId(kAda)).linear_velocity.x, 6 * kNewtons / 60, 1e-4) << "its own body again";
  EXPECT_EQ(StateOf(kCar).linear_velocity.x, 0);
}

TEST_F(RegionControlTest, WhoMovesNothingLooksOnFromThere) {
  Begin({{-8, 0, 5}});
  Steps(2);
  Control(kAda, kCar);
  Steps(4);
  Order(kAda, [](GameCalls& calls) {
    const tessera_game_value arguments[] = {game::ToInterface(GameValue(kAda)), tessera_game_value{}};
    return calls.CallRaw(game::kPlayerControl, arguments);
  });
  Steps(2);
  EXPECT_EQ(RecordOf(PlayerBodyId(kAda)).player->stage, PlayerStage::kSpectating);
  EXPECT_EQ(RecordOf(kCar).driver, PlayerNumber());
  EXPECT_NEAR(StateOf(PlayerBodyId(kAda)).position.x, -8, 1e-9);
}

TEST_F(RegionControlTest, WhoseBodyIsRemovedLooksOn) {
  Begin({{-8, 0, 5}});
  Steps(2);
  Control(kAda, kCar);
  Steps(4);
  Order(kAda, [](GameCalls& calls) { return calls.Call(game::kBodyRemove, {kCar}); });
  Steps(3);
  EXPECT_THAT(news, ElementsAre("1 moves 1", "1: body 1 is gone"));
  EXPECT_EQ(RecordOf(PlayerBodyId(kAda)).player->stage, PlayerStage::kSpectating);
}

TEST_F(RegionControlTest, WhoLeavesLetsGo) {
  Begin({{-8, 0, 5}});
  Steps(2);
  Control(kAda, kCar);
  Steps(4);
  one->RemovePlayer(kAda);
  two->RemovePlayer(kAda);
  Steps(2);
  EXPECT_FALSE(one->Owns(PlayerBodyId(kAda)));
  EXPECT_EQ(RecordOf(kCar).driver, PlayerNumber());
}

TEST_F(RegionControlTest, OneThatIsCutOffIsAnsweredWithinSeconds) {
  Begin({{7, 0, 5}});
  Steps(2);
  Control(kAda, kCar);
  Step();
  one->TakeLinkDown(kTwo);
  for (int i = 0; i < 130; ++i) {
    ASSERT_TRUE(one->CanStep());
    one->Step();
  }
  ASSERT_EQ(news.size(), 1U);
  EXPECT_THAT(news[0], HasSubstr("1: body 1 was not found"));
  EXPECT_EQ(RecordOf(PlayerBodyId(kAda)).player->stage, PlayerStage::kPlaying);
}

TEST_F(RegionControlTest, BrokenRulesAreNamed) {
  Begin({{-8, 0, 5}});
  Steps(2);
  std::vector<std::string> errors;
  Order(kAda, [&](GameCalls& calls) {
    for (const BodyId id : {PlayerBodyId(kAda), PlayerBodyId(kBob), BodyId(77)}) {
      EXPECT_FALSE(calls.Call(game::kPlayerControl, {kAda, id}));
      errors.push_back(calls.error());
    }
    return true;
  });
  Step();
  EXPECT_THAT(errors, ElementsAre("control: respawn gives a player its own body back",
                                  "control: body 4294967298 is a player's own", "control: there is no body 77"));
}

TEST_F(RegionControlTest, LimitsOfTheGameTakeTheSceneSPlace) {
  Begin({{-8, 0, 5}});
  Steps(2);
  Order(kAda, [](GameCalls& calls) {
    const GameValue force{3.0}, axes{Vec3d{0.5, 0, 1}};
    const tessera_game_field fields[] = {{"axes", 4, game::ToInterface(axes)}, {"force", 5, game::ToInterface(force)}};
    tessera_game_value limits{};
    limits.type = TESSERA_GAME_FIELDS;
    limits.count = 2;
    limits.as.fields = fields;
    const tessera_game_value arguments[] = {game::ToInterface(GameValue(kAda)), limits};
    return calls.CallRaw(game::kPlayerSetLimits, arguments);
  });
  Step();
  ASSERT_NO_FATAL_FAILURE(Push(kAda, 10));
  Steps(2);
  EXPECT_NEAR(StateOf(PlayerBodyId(kAda)).linear_velocity.x, 10 * 3 * 0.5 / 60, 1e-4);
}

TEST_F(RegionControlTest, ASavedStateHasIt) {
  Begin({{-8, 0, 5}});
  Steps(2);
  Control(kAda, kCar);
  Steps(4);
  const auto state = DecodeState(one->SaveState(), one->catalog());
  ASSERT_TRUE(state.ok()) << state.status();
  one = Make(kOne, std::make_shared<const RegionState>(*state));
  ExpectMoves(kAda, kCar);
}

// Region 2 has taken both in and dies before its standby acknowledges anything: region 1 still has its copies.
TEST_F(RegionControlTest, ADeathPartsNobody) {
  Begin({{-2, 0, 5}}, {6, 0, 0});
  two->SetStandby(true);
  StandbyCopy copy(kTwo, two->catalog());
  Step();
  ASSERT_TRUE(copy.Receive(log_of_two).ok());
  Control(kAda, kCar);
  for (int i = 0; i < 50; ++i) {
    Step();
    // The copy stops in a tick before they come.
    if (i < 5) {
      ASSERT_TRUE(copy.Receive(log_of_two).ok());
    }
  }
  ASSERT_TRUE(two->Owns(kCar));
  ExpectMoves(kAda, kCar);
  const auto resolution = CarryOn(*one, kTwo, copy, {kCar, PlayerBodyId(kAda)});
  ASSERT_TRUE(resolution.ok()) << resolution.status();
  EXPECT_THAT(resolution->lost, IsEmpty());
  ASSERT_TRUE(one->Owns(kCar) && one->Owns(PlayerBodyId(kAda)));
  for (int i = 0; i < 5; ++i) one->Step();
  const game::GameRecord& own = one->records().Find(PlayerBodyId(kAda))->game;
  EXPECT_EQ(own.player->driven(), kCar);
  EXPECT_THAT(news, ElementsAre("1 moves 1")) << "it has not ended meanwhile";
}

}  // namespace
}  // namespace tessera::region::control
