// Control of other bodies, as one region's records have it; core/region/region_control_test.cpp has the way of it.
#include "core/game/control_calls.h"

#include <gmock/gmock.h>

#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "core/game/testing/scripted_game.h"

namespace tessera::game::control {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr PlayerNumber kAda{3}, kBob{5};
constexpr std::uint64_t kCar = 7, kCart = 8;

class ControlCallsTest : public ::testing::Test {
 protected:
  ControlCallsTest() {
    world.AddPlayer(3, "ada");
    world.AddPlayer(5, "bob");
    world.Add(kCar, 1);
    world.Add(kCart, 1);
    world.state(kCar).position = {4, 5, 6};
    game.On(kOnControl, "", [this](GameCalls&, ScriptedGame::Arguments arguments) {
      const bool none = arguments[1].type == TESSERA_GAME_NOTHING;
      said.push_back(none ? std::string(arguments[2].as.text, arguments[2].count)
                          : std::to_string(arguments[0].as.id) + " moves " + std::to_string(arguments[1].as.id));
      return on_control_succeeds;
    });
    game.On(kOnTick, "", [this](GameCalls& calls, ScriptedGame::Arguments) {
      if (act && !std::exchange(act, nullptr)(calls)) ADD_FAILURE() << calls.error();
      return true;
    });
    module_ = game.module();
    host = *GameHost::Load(module_, {"game.lua", "fine"}, world.shared_scene());
  }
  void Run(int ticks = 1) {
    for (int i = 0; i < ticks; ++i) host->Run(++tick, {}, world);
  }
  void Control(PlayerNumber player, std::uint64_t body) {
    act = [=](GameCalls& calls) { return calls.Call(kPlayerControl, {player, BodyId(body)}); };
    Run();
  }
  const PlayerRecord& of(PlayerNumber player) const { return *world.record(PlayerBodyId(player).value()).player; }
  // Gives the body, or the player, that the function names; 0: nothing.
  std::uint64_t Ask(std::uint32_t function, const GameValue& whom) {
    std::uint64_t named = 0;
    act = [&](GameCalls& calls) {
      if (!calls.Call(function, {whom})) return false;
      if (calls.result().type != TESSERA_GAME_NOTHING) named = calls.result().as.id;
      return true;
    };
    Run();
    return named;
  }

  FakeGameWorld world;
  ScriptedGame game;
  std::unique_ptr<GameHost> host;
  Tick tick;
  std::vector<std::string> said;
  std::function<bool(GameCalls&)> act;
  bool on_control_succeeds = true;

 private:
  tessera_game_module module_{};
};

TEST_F(ControlCallsTest, BothEndsAreNamedOnceItIsInForce) {
  EXPECT_EQ(Ask(kPlayerControlled, kAda), PlayerBodyId(kAda).value());
  EXPECT_EQ(Ask(kBodyController, PlayerBodyId(kAda)), kAda.value());
  EXPECT_EQ(Ask(kBodyController, BodyId(kCar)), 0U);
  Control(kAda, kCar);
  EXPECT_EQ(of(kAda).stage, PlayerStage::kPlaying) << "until it is answered";
  Run(2);
  EXPECT_THAT(said, ElementsAre("3 moves 7"));
  EXPECT_EQ(Ask(kPlayerControlled, kAda), kCar);
  EXPECT_EQ(Ask(kBodyController, BodyId(kCar)), kAda.value());
  EXPECT_EQ(Ask(kBodyController, PlayerBodyId(kAda)), 0U);
  EXPECT_EQ(world.StateOf(PlayerBodyId(kAda)).position, (Vec3d{4, 5, 6}));
}

TEST_F(ControlCallsTest, AnotherBodyTakesThePlaceOfTheFirst) {
  Control(kAda, kCar);
  Run(2);
  Control(kAda, kCart);
  EXPECT_EQ(world.record(kCar).driver, PlayerNumber()) << "at once";
  Run(2);
  EXPECT_EQ(of(kAda).driven(), BodyId(kCart));
  EXPECT_THAT(said, ElementsAre("3 moves 7", "3 moves 8"));
}

TEST_F(ControlCallsTest, ItIsInForceThoughTheCallbackFails) {
  on_control_succeeds = false;
  Control(kAda, kCar);
  Run(2);
  EXPECT_EQ(of(kAda).driven(), BodyId(kCar));
}

TEST_F(ControlCallsTest, WhatHangsTogetherHasOneDriver) {
  world.assembly = {BodyId(kCar), BodyId(kCart)};
  Control(kAda, kCar);
  Run(2);
  Control(kBob, kCart);
  Run(4);
  EXPECT_THAT(said, ElementsAre("3 moves 7", "body 8 hangs together with what player 3 moves"));
}

TEST_F(ControlCallsTest, KinematicAndStaticBodiesAreRefused) {
  world.def(kCar).kinematic = true;
  world.def(kCart).motion = Motion::kStatic;
  std::vector<std::string> errors;
  act = [&](GameCalls& calls) {
    for (const std::uint64_t id : {kCar, kCart}) {
      EXPECT_FALSE(calls.Call(kPlayerControl, {kAda, BodyId(id)}));
      errors.push_back(calls.error());
    }
    return true;
  };
  Run();
  EXPECT_THAT(errors, ElementsAre("control: body 7 is kinematic: no force moves it", "control: body 8 does not move"));
  EXPECT_THAT(said, IsEmpty());
}

TEST_F(ControlCallsTest, ABodyWaitsTwoSecondsForItsPlayer) {
  world.Lose(PlayerBodyId(kAda).value());
  const_cast<GameRecord&>(world.record(kCar)).driver = kAda;
  const_cast<GameRecord&>(world.record(kCar)).driver_until = Tick(121);
  Run(120);
  EXPECT_EQ(world.record(kCar).driver, kAda);
  Run();
  EXPECT_EQ(world.record(kCar).driver, PlayerNumber());
}

TEST_F(ControlCallsTest, WhoIsKickedLetsGo) {
  Control(kAda, kCar);
  Run(2);
  act = [](GameCalls& calls) { return calls.Call(kPlayerKick, {kAda, std::string("idle")}); };
  Run();
  EXPECT_EQ(world.record(kCar).driver, PlayerNumber());
  EXPECT_EQ(of(kAda).stage, PlayerStage::kKicked);
  EXPECT_TRUE(CheckPlayerRecord(of(kAda)).ok());
}

TEST_F(ControlCallsTest, LimitsAreCheckedByName) {
  const auto set = [&](const char* name, const GameValue& value) {
    std::string error;
    act = [&](GameCalls& calls) {
      const tessera_game_field field{name, std::string_view(name).size(), ToInterface(value)};
      tessera_game_value table{};
      table.type = TESSERA_GAME_FIELDS;
      table.count = 1;
      table.as.fields = &field;
      const tessera_game_value arguments[] = {ToInterface(GameValue(kAda)), table};
      if (!calls.CallRaw(kPlayerSetLimits, arguments)) error = calls.error();
      return true;
    };
    Run();
    return error;
  };
  EXPECT_EQ(set("speed", 3.0), "");
  EXPECT_EQ(of(kAda).limits.speed_m_s, 3.0F);
  EXPECT_EQ(set("force", std::numeric_limits<double>::quiet_NaN()), "set_limits: `force` must be 0 to 1e+15, got nan");
  EXPECT_EQ(set("axes", Vec3d{1, 2, 1}), "set_limits: `axes` must have parts from 0 to 1");
  EXPECT_EQ(set("height", 2.0), "set_limits: `height` is none of force, torque, speed, axes");
  EXPECT_EQ(of(kAda).limits.speed_m_s, 3.0F) << "what was refused changes nothing";
}

}  // namespace
}  // namespace tessera::game::control
