// Players as a game has them: on_join, commands, events, and who is sent away or spectates.
#include "core/game/player_calls.h"

#include <gmock/gmock.h>

#include <string>

#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "core/game/testing/scripted_game.h"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using GivenArguments = ScriptedGame::Arguments;

constexpr PlayerNumber kAda{3}, kBob{5};

class PlayerCallsTest : public ::testing::Test {
 protected:
  PlayerCallsTest() { world.AddPlayer(3, "ada"); }
  void Load(GameSettings settings = {}) {
    module_ = game.module();
    auto loaded = GameHost::Load(module_, {"game.lua", "fine"}, world.shared_scene(), settings, 5);
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    host = *std::move(loaded);
  }
  void Run(const PlayerChanges& players = {}) { host->Run(++tick, {}, world, players); }
  // Gives what a function of the table said in a tick of the world: its error, or nothing.
  std::string Call(std::uint32_t function, std::vector<GameValue> arguments) {
    std::string said;
    game.On(kOnTick, "", [&](GameCalls& calls, GivenArguments) {
      if (!calls.Call(function, arguments)) said = calls.error();
      return true;
    });
    Load();
    Run();
    return said;
  }
  const PlayerRecord& talk(PlayerNumber player = kAda) const {
    return *world.record(PlayerBodyId(player).value()).player;
  }
  GameRecord& record(PlayerNumber player = kAda) { return world.AddPlayer(player.value(), "ada"); }

  FakeGameWorld world;
  ScriptedGame game;
  std::unique_ptr<GameHost> host;
  Tick tick;

 private:
  tessera_game_module module_{};
};

TEST_F(PlayerCallsTest, OnJoinIsToldWhoCameAndMayPlaceTheBody) {
  std::string name;
  game.On(kOnJoin, "", [&](GameCalls& calls, GivenArguments arguments) {
    EXPECT_EQ(arguments[0].type, TESSERA_GAME_PLAYER);
    const PlayerNumber player(static_cast<std::uint32_t>(arguments[0].as.id));
    EXPECT_TRUE(calls.Call(kPlayerName, {player}));
    name.assign(calls.result().as.text, calls.result().count);
    EXPECT_TRUE(calls.Call(kPlayerPlace, {player, Vec3d{1, 2, 3}})) << calls.error();
    EXPECT_TRUE(calls.Call(kBodyPosition, {PlayerBodyId(player)}));
    EXPECT_EQ(calls.result().as.vector[1], 2) << "within the callback";
    return true;
  });
  Load();
  Run({.joined = {kAda}, .leaving = {}});
  EXPECT_EQ(name, "ada");
  EXPECT_EQ(world.StateOf(PlayerBodyId(kAda)).position, (Vec3d{1, 2, 3}));
  Run();
  EXPECT_EQ(host->statistics().calls, 1U) << "once";
}

TEST_F(PlayerCallsTest, ARefusedPlayerIsNotToldToLeave) {
  int leaves = 0;
  game.On(kOnJoin, "", [&](GameCalls& calls, GivenArguments) {
    return calls.Call(kPlayerRefuse, {kAda, std::string("the match has begun")});
  });
  game.On(kOnLeave, "", [&](GameCalls&, GivenArguments) { return ++leaves > 0; });
  Load();
  Run({.joined = {kAda}, .leaving = {}});
  EXPECT_EQ(talk().stage, PlayerStage::kRefused);
  EXPECT_EQ(talk().reason, "the match has begun");
  Run({.joined = {}, .leaving = {kAda}});
  EXPECT_EQ(leaves, 0);
  EXPECT_THAT(world.ids(), IsEmpty());
}

TEST_F(PlayerCallsTest, OneWhoFailedToJoinIsIn) {
  game.On(kOnJoin, "", [&](GameCalls& calls, GivenArguments) {
    calls.Call(kPlayerRefuse, {kAda, std::string("no")});
    return false;
  });
  Load();
  Run({.joined = {kAda}, .leaving = {}});
  EXPECT_EQ(talk().stage, PlayerStage::kPlaying) << "the call's effects are discarded";
}

TEST_F(PlayerCallsTest, OnLeaveIsCalledBeforeTheBodyGoes) {
  bool there = false;
  game.On(kOnLeave, "", [&](GameCalls& calls, GivenArguments) {
    there = calls.Call(kPlayerName, {kAda});
    EXPECT_FALSE(calls.Call(kPlayerKick, {kAda, std::string("no")}));
    EXPECT_THAT(calls.error(), HasSubstr("leaves already"));
    return true;
  });
  Load();
  Run({.joined = {}, .leaving = {kAda}});
  EXPECT_TRUE(there);
  EXPECT_THAT(world.ids(), IsEmpty());
}

TEST_F(PlayerCallsTest, OnlyOnJoinRefusesAndAnyoneKicks) {
  EXPECT_THAT(Call(kPlayerRefuse, {kAda, std::string("no")}), HasSubstr("only on_join may refuse"));
  EXPECT_EQ(Call(kPlayerKick, {kAda, std::string("idle")}), "");
  EXPECT_EQ(talk().stage, PlayerStage::kKicked);
  EXPECT_EQ(talk().reason, "idle");
  EXPECT_EQ(Call(kPlayerKick, {kAda, std::string("again")}), "");
  EXPECT_EQ(talk().reason, "idle") << "the first counts";
  EXPECT_THAT(Call(kPlayerSend, {kAda, std::string("bye")}), HasSubstr("was sent away"));
}

TEST_F(PlayerCallsTest, AReasonIsATextForAPerson) {
  EXPECT_THAT(Call(kPlayerKick, {kAda, std::string(201, 'x')}), HasSubstr("`reason` has more than 200 bytes"));
  EXPECT_THAT(Call(kPlayerKick, {kAda, std::string("a\nb")}), HasSubstr("control character"));
  EXPECT_THAT(Call(kPlayerKick, {kAda, std::string("\xff")}), HasSubstr("is not UTF-8"));
}

TEST_F(PlayerCallsTest, CommandsComeOnceInOrderAndInTheTicksThatHaveTimeForThem) {
  record().player.Change().commands = {"a", "b", "c"};
  world.AddPlayer(5).player.Change().commands = {"x"};
  std::vector<std::string> got;
  game.On(kOnCommand, "", [&](GameCalls& calls, GivenArguments arguments) {
    got.push_back(std::to_string(arguments[0].as.id) + std::string(arguments[1].as.text, arguments[1].count));
    calls.Charge(60);
    return got.size() != 2;  // the second one fails, and is over
  });
  Load({.instructions_per_tick = 100});
  Run();
  EXPECT_THAT(got, ElementsAre("3a", "3b"));
  EXPECT_THAT(talk().commands, ElementsAre("c"));
  Run();
  Run();
  EXPECT_THAT(got, ElementsAre("3a", "3b", "3c", "5x"));
  EXPECT_THAT(talk().commands, IsEmpty());
  EXPECT_EQ(host->statistics().errors, 1U);
}

TEST_F(PlayerCallsTest, CommandsOfOneWhoIsSentAwayAreDropped) {
  record().player.Change().commands = {"a", "b"};
  int got = 0;
  game.On(kOnCommand, "", [&](GameCalls& calls, GivenArguments) {
    ++got;
    return calls.Call(kPlayerKick, {kAda, std::string("cheats")});
  });
  Load();
  Run();
  EXPECT_EQ(got, 1);
  EXPECT_THAT(talk().commands, IsEmpty());
}

TEST_F(PlayerCallsTest, WithoutACallbackCommandsAreDropped) {
  record().player.Change().commands = {"a", "b"};
  Load();
  Run();
  EXPECT_THAT(talk().commands, IsEmpty());
}

TEST_F(PlayerCallsTest, EventsAreNumberedAndBounded) {
  EXPECT_EQ(Call(kPlayerSend, {kAda, std::string("score")}), "");
  EXPECT_EQ(talk().last_event, 1U);
  EXPECT_EQ(talk().first_event(), 1U);
  game.On(kOnTick, "", [&](GameCalls& calls, GivenArguments) {
    return calls.Call(kPlayerSend, {kAda, std::string("score")});
  });
  Load();
  for (std::size_t i = 1; i < kMaxWaitingEventsOfPlayer; ++i) Run();
  EXPECT_EQ(host->statistics().errors, 0U);
  EXPECT_THAT(talk().events, SizeIs(kMaxWaitingEventsOfPlayer));
  Run();
  EXPECT_EQ(host->statistics().errors, 1U) << "one more than may wait";
  PlayerRecord acknowledged = talk();
  acknowledged.Acknowledge(60);
  EXPECT_EQ(acknowledged.first_event(), 61U);
  acknowledged.Acknowledge(1000);
  EXPECT_THAT(acknowledged.events, SizeIs(4)) << "a number that was never given";
  acknowledged.Acknowledge(64);
  EXPECT_THAT(acknowledged.events, IsEmpty());
}

TEST_F(PlayerCallsTest, WhatIsWrongWithAnEventIsNamed) {
  EXPECT_THAT(Call(kPlayerSend, {kAda, std::string()}), HasSubstr("`name` is empty"));
  EXPECT_THAT(Call(kPlayerSend, {kAda, std::string(33, 'x')}), HasSubstr("`name` has more than 32 bytes"));
  EXPECT_THAT(Call(kPlayerSend, {kAda, std::string("\xff")}), HasSubstr("`name` is not UTF-8"));
  EXPECT_THAT(Call(kPlayerSend, {kBob, std::string("score")}), HasSubstr("player 5 has no body that this region owns"));
  EXPECT_THAT(Call(kPlayerSend, {PlayerNumber(), std::string("score")}), HasSubstr("there is no player 0"));
}

TEST_F(PlayerCallsTest, ABroadcastGoesToThePlayersThatAreOwnedHere) {
  world.AddPlayer(5);
  const GameValue name = std::string("round");
  game.On(kOnTick, "", [&](GameCalls& calls, GivenArguments) {
    EXPECT_TRUE(calls.Call(kWorldPlayers, {}));
    EXPECT_EQ(calls.result().count, 2U);
    EXPECT_EQ(calls.result().as.list[1].as.id, 5U);
    EXPECT_TRUE(calls.Call(kWorldBroadcast, {name})) << calls.error();
    EXPECT_EQ(calls.result().as.whole, 2);
    return true;
  });
  Load();
  Run();
  EXPECT_EQ(talk(kAda).last_event, 1U);
  EXPECT_EQ(talk(kBob).last_event, 1U);
}

TEST_F(PlayerCallsTest, ASpectatorStandsWhereItLooksFromAndComesBack) {
  EXPECT_EQ(Call(kPlayerSpectate, {kAda, Vec3d{10, 20, 30}}), "");
  EXPECT_EQ(talk().stage, PlayerStage::kSpectating);
  EXPECT_TRUE(talk().hidden());
  EXPECT_EQ(world.StateOf(PlayerBodyId(kAda)).position, (Vec3d{10, 20, 30}));
  EXPECT_EQ(Call(kPlayerPlace, {kAda, Vec3d{11, 20, 30}}), "");
  EXPECT_EQ(talk().stage, PlayerStage::kSpectating) << "only the view moves";
  EXPECT_EQ(Call(kPlayerRespawn, {kAda, Vec3d{1, 1, 1}}), "");
  EXPECT_EQ(talk().stage, PlayerStage::kPlaying);
  EXPECT_THAT(Call(kPlayerRespawn, {kAda, Vec3d{1000, 1, 1}}), HasSubstr("outside the scene's bounds"));
}

TEST(PlayerRecordTest, ComesOutAsItWentInAndRefusesWhatNoGameMade) {
  PlayerRecord record;
  record.stage = PlayerStage::kKicked;
  record.reason = "idle";
  record.last_command = 900;
  record.commands = {"a", std::string("\0\xff", 2)};
  record.last_event = 7;
  record.events = {{"score", {}}, {"score", {}}};
  ByteWriter out;
  Write(out, record);
  ByteReader in(out.bytes());
  EXPECT_EQ(ReadPlayerRecord(in), record);
  EXPECT_TRUE(in.ok());
  EXPECT_TRUE(CheckPlayerRecord(record).ok());
  const auto why_not = [&](auto change) {
    PlayerRecord changed = record;
    change(changed);
    return std::string(CheckPlayerRecord(changed).message());
  };
  EXPECT_THAT(why_not([](PlayerRecord& r) { r.reason = "\n"; }), HasSubstr("reason"));
  EXPECT_THAT(why_not([](PlayerRecord& r) { r.stage = PlayerStage::kPlaying; }), HasSubstr("of one who plays"));
  EXPECT_THAT(why_not([](PlayerRecord& r) { r.last_command = 1; }), HasSubstr("commands"));
  EXPECT_THAT(why_not([](PlayerRecord& r) { r.last_event = 1; }), HasSubstr("events"));
  EXPECT_THAT(why_not([](PlayerRecord& r) { r.events[0].name = ""; }), HasSubstr("a name is empty"));
  EXPECT_THAT(why_not([](PlayerRecord& r) { r.events[0].values = {9}; }), HasSubstr("values"));
}

// --- Inputs

TEST_F(PlayerCallsTest, AGameReadsTheInputOfTheTick) {
  world.input = PlayerInput{.number = 4, .move = {0.5F, -0.25F}, .yaw_rad = 1, .pitch_rad = 0.5F, .buttons = 5};
  int fields = 0;
  game.On(kOnTick, "", [&](GameCalls& calls, GivenArguments) {
    EXPECT_TRUE(calls.Call(kPlayerInput, {kAda})) << calls.error();
    const tessera_game_value& value = calls.result();
    fields = static_cast<int>(value.count);
    const auto field = [&](int i) { return std::string(value.as.fields[i].name, value.as.fields[i].name_bytes); };
    EXPECT_EQ(field(0), "buttons");
    EXPECT_EQ(value.as.fields[0].value.as.whole, 5);
    EXPECT_EQ(field(1), "look");
    EXPECT_EQ(value.as.fields[1].value.as.vector[2], -1);
    EXPECT_EQ(field(2), "move");
    EXPECT_EQ(value.as.fields[2].value.as.vector[0], 0.5);
    EXPECT_EQ(value.as.fields[2].value.as.vector[1], -0.25);
    EXPECT_EQ(field(3), "pitch");
    EXPECT_EQ(field(4), "yaw");
    EXPECT_TRUE(calls.Call(kPlayerNumber, {kBob})) << "anywhere";
    EXPECT_EQ(calls.result().as.whole, 5);
    return true;
  });
  Load();
  Run();
  EXPECT_EQ(fields, 5);
  EXPECT_THAT(Call(kPlayerInput, {kBob}), HasSubstr("player 5 has no body that this region owns"));
}

TEST_F(PlayerCallsTest, TheShownTimeIsBelievedWithinLimits) {
  const double rate = world.scene().tick_rate_hz;
  tick = Tick(1000);
  double shown = -1;
  const auto after = [&](std::uint64_t said) {
    world.input = PlayerInput{.number = 1, .shown_at = said};
    game.On(kOnTick, "", [&](GameCalls& calls, GivenArguments) {
      EXPECT_TRUE(calls.Call(kPlayerShownTime, {kAda})) << calls.error();
      shown = calls.result().as.real;
      return true;
    });
    Load();
    Run();
    return shown;
  };
  EXPECT_EQ(after(ShownAt(990.5)), 990.5);
  EXPECT_EQ(after(0), 1002) << "said nothing";
  EXPECT_EQ(after(ShownAt(5000)), 1003) << "the future";
  EXPECT_EQ(after(1), 1004 - 0.4 * rate) << "long ago";
  EXPECT_EQ(after(~std::uint64_t{0}), 1005);
  world.input.reset();
  Run();
  EXPECT_EQ(shown, 1006);
}

TEST_F(PlayerCallsTest, ACommandHasItsOwnShownTime) {
  tick = Tick(1000);
  world.input = PlayerInput{.number = 1, .shown_at = ShownAt(999)};
  record().player.Change().last_command = 2;
  record().player.Change().commands = {{"shoot", ShownAt(985.25)}, "jump"};
  std::vector<double> shown;
  const auto note = [&](GameCalls& calls, GivenArguments) {
    EXPECT_TRUE(calls.Call(kPlayerShownTime, {kAda})) << calls.error();
    shown.push_back(calls.result().as.real);
    return true;
  };
  game.On(kOnCommand, "", note);
  game.On(kOnTick, "", note);
  Load();
  Run();
  EXPECT_THAT(shown, ElementsAre(999, 985.25, 1001));
}

// A command that waits for an input holds back all that were given after it, so the order stays.
TEST_F(PlayerCallsTest, ACommandThatGoesWithAnInputComesInTheTickInWhichThatHasActed) {
  record().player.Change().last_command = 3;
  record().player.Change().commands = {"a", "b", "c"};
  record().player.Change().commands[1].with_input = 8;
  record().player.Change().commands[1].due = Tick(12);
  std::vector<std::string> got;
  game.On(kOnCommand, "", [&](GameCalls&, GivenArguments arguments) {
    got.emplace_back(arguments[1].as.text, arguments[1].count);
    return true;
  });
  Load();
  Run();
  EXPECT_THAT(got, ElementsAre("a")) << "no input has come yet";
  world.input = PlayerInput{.number = 7};
  Run();
  EXPECT_THAT(got, ElementsAre("a"));
  EXPECT_THAT(talk().commands, SizeIs(2));
  world.input = PlayerInput{.number = 8};
  Run();
  EXPECT_THAT(got, ElementsAre("a", "b", "c"));
}

TEST_F(PlayerCallsTest, ACommandWaitsForAnInputThatNeverComesUntilItIsDue) {
  record().player.Change().last_command = 1;
  record().player.Change().commands = {"a"};
  record().player.Change().commands[0].with_input = ~std::uint32_t{0};
  record().player.Change().commands[0].due = Tick(3);
  int calls_of_it = 0;
  game.On(kOnCommand, "", [&](GameCalls&, GivenArguments) { return ++calls_of_it > 0; });
  Load();
  Run();
  Run();
  EXPECT_EQ(calls_of_it, 0);
  Run();
  EXPECT_EQ(calls_of_it, 1);
}

// No region asks for such a wait; a record of a faulty neighbour could.
TEST_F(PlayerCallsTest, NoCommandWaitsForLongerThanCommandsDo) {
  record().player.Change().last_command = 1;
  record().player.Change().commands = {"a"};
  record().player.Change().commands[0].with_input = 1000;
  record().player.Change().commands[0].due = Tick(1 + kMaxCommandWait_ticks + 1);
  int calls_of_it = 0;
  game.On(kOnCommand, "", [&](GameCalls&, GivenArguments) { return ++calls_of_it > 0; });
  Load();
  Run();
  EXPECT_EQ(calls_of_it, 1);
}

TEST_F(PlayerCallsTest, WhatWaitsForAnInputIsGivenBeforeThePlayerGoes) {
  record().player.Change().last_command = 2;
  record().player.Change().commands = {"a", "b"};
  record().player.Change().commands[0].with_input = 1000;
  record().player.Change().commands[0].due = Tick(10);
  std::vector<std::string> got;
  game.On(kOnCommand, "", [&](GameCalls&, GivenArguments arguments) {
    got.emplace_back(arguments[1].as.text, arguments[1].count);
    return true;
  });
  game.On(kOnLeave, "", [&](GameCalls&, GivenArguments) {
    got.emplace_back("left");
    return true;
  });
  Load();
  Run();
  EXPECT_THAT(got, IsEmpty());
  Run({.joined = {}, .leaving = {kAda}});
  EXPECT_THAT(got, ElementsAre("a", "b", "left"));
}

}  // namespace
}  // namespace tessera::game
