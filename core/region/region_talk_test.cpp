// Players and a game in two regions: what they say to each other goes wherever the player's body goes.
#include <gmock/gmock.h>

#include "core/game/game_host.h"
#include "core/game/testing/named_fields.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/log.h"
#include "core/region/region.h"
#include "core/region/region_state.h"
#include "core/region/testing/small_world.h"
#include "game_sdk/api/api.h"

namespace tessera::region {
namespace {

using game::GameCalls;
using game::GameHost;
using game::PlayerRecord;
using game::ScriptedGame;
using Arguments = ScriptedGame::Arguments;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr PlayerNumber kTalker{3};
constexpr BodyId kTalkersBody = PlayerBodyId(kTalker);

class RegionTalkTest : public ::testing::Test {
 protected:
  void Begin(bool with_game = true) {
    Scene scene = Balls({{8, 0, 8}});
    scene.kinds = {""};
    AllowPlayers(scene);
    Prefab& ball = scene.prefabs.emplace_back();
    ball.name = "ball";
    ball.bodies.push_back(scene.bodies[0]);
    ball.bodies[0].initial = {};
    scene_ = std::make_shared<const Scene>(std::move(scene));
    module_ = game.module();
    one = Make(kOne, with_game);
    two = Make(kTwo, with_game);
    Send(kOne, one->Start());
    Send(kTwo, two->Start());
    one->SpawnPlayer(kTalker, "ada");
  }
  void Step() {
    ASSERT_TRUE(one->CanStep() && two->CanStep());
    const StepResult first = one->Step(), second = two->Step();
    Send(kOne, first.frames);
    Send(kTwo, second.frames);
  }
  void Steps(int count) {
    for (int i = 0; i < count; ++i) ASSERT_NO_FATAL_FAILURE(Step());
  }
  Region& owner() { return one->Owns(kTalkersBody) ? *one : *two; }
  absl::StatusCode Command(std::uint32_t number, std::string_view bytes, std::uint32_t base = 1) {
    return owner().TakeCommand(kTalker, {base, number, bytes}).code();
  }
  // Calls a function about the player in the next tick.
  void Do(std::uint32_t function, std::vector<game::GameValue> arguments) {
    arguments.insert(arguments.begin(), game::GameValue(kTalker));
    next_ = {function, std::move(arguments)};
  }
  void HandleTicks() {
    game.On(game::kOnTick, "", [this](GameCalls& calls, Arguments) {
      if (next_.first == 0 || !calls.Call(game::kPlayerName, {kTalker})) return true;
      EXPECT_TRUE(calls.Call(next_.first, next_.second)) << calls.error();
      next_.first = 0;
      return true;
    });
  }

  ScriptedGame game;
  std::unique_ptr<Region> one, two;

 private:
  std::unique_ptr<Region> Make(RegionId self, bool with_game) {
    Config config{self, Incarnation(1), scene_, *MakeGridMap(scene_->ground(), 2), {}};
    if (with_game) {
      auto host = GameHost::Load(module_, {"game.lua", "fine"}, scene_);
      EXPECT_TRUE(host.ok()) << host.status();
      config.game = *std::move(host);
    }
    return std::make_unique<Region>(std::move(config));
  }
  void Send(RegionId from, const std::vector<OutgoingFrame>& frames) {
    for (const OutgoingFrame& frame : frames) {
      const absl::Status status = (from == kOne ? two : one)->Receive(from, frame.bytes);
      EXPECT_TRUE(status.ok()) << status;
    }
  }

  std::shared_ptr<const Scene> scene_;
  tessera_game_module module_{};
  std::pair<std::uint32_t, std::vector<game::GameValue>> next_;
};

TEST_F(RegionTalkTest, APlayerJoinsOnceAndLeavesOnce) {
  std::vector<std::string> said;
  game.On(game::kOnJoin, "", [&](GameCalls&, Arguments) {
    said.emplace_back("join");
    return true;
  });
  game.On(game::kOnLeave, "", [&](GameCalls&, Arguments) {
    said.emplace_back("leave");
    return true;
  });
  Begin();
  Steps(3);
  EXPECT_THAT(said, ElementsAre("join"));
  one->RemovePlayer(kTalker);
  two->RemovePlayer(kTalker);
  Steps(3);
  EXPECT_THAT(said, ElementsAre("join", "leave"));
  EXPECT_FALSE(one->Owns(kTalkersBody) || two->Owns(kTalkersBody));
}

TEST_F(RegionTalkTest, OneWhoIsRefusedIsNeverShown) {
  game.On(game::kOnJoin, "", [&](GameCalls& calls, Arguments) {
    return calls.Call(game::kPlayerRefuse, {kTalker, std::string("full")});
  });
  Begin();
  Step();
  ASSERT_TRUE(one->Owns(kTalkersBody));
  EXPECT_TRUE(one->IsHidden(kTalkersBody));
  EXPECT_THAT(one->ended_players(), ElementsAre(EndedPlayer{kTalker, "full"}));
  EXPECT_TRUE(one->world().IsParked(kTalkersBody));
  Step();
  EXPECT_EQ(two->ghost_count(), 0U);
  one->RemovePlayer(kTalker);
  Step();
  EXPECT_FALSE(one->Owns(kTalkersBody));
  EXPECT_THAT(one->ended_players(), IsEmpty());
}

TEST_F(RegionTalkTest, WhatIsTakenIsToldWhenTheStandbyHasIt) {
  Begin();
  Step();
  one->SetStandby(true);
  Step();
  one->LogAcknowledged(one->tick());
  Step();
  ASSERT_EQ(Command(1, "jump"), absl::StatusCode::kOk);
  Step();
  ASSERT_NE(one->TalkOf(kTalker), nullptr);
  EXPECT_EQ(one->TalkOf(kTalker)->last_command, 0U);
  one->LogAcknowledged(one->tick());
  Step();
  EXPECT_EQ(one->TalkOf(kTalker)->last_command, 1U);
}

TEST_F(RegionTalkTest, EachCommandIsTakenOnceAndInOrder) {
  std::vector<std::string> got;
  game.On(game::kOnCommand, "", [&](GameCalls&, Arguments arguments) {
    got.emplace_back(arguments[1].as.text, arguments[1].count);
    return true;
  });
  Begin();
  EXPECT_EQ(Command(1, "a"), absl::StatusCode::kNotFound) << "not there yet";
  Step();
  EXPECT_EQ(Command(2, "b"), absl::StatusCode::kOutOfRange) << "the one before it is missing";
  EXPECT_EQ(Command(1, "a"), absl::StatusCode::kOk);
  EXPECT_EQ(Command(1, "a"), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(Command(2, "b"), absl::StatusCode::kOk);
  Step();
  EXPECT_EQ(Command(2, "b"), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(Command(70, "c", 70), absl::StatusCode::kOk) << "none below it comes";
  EXPECT_EQ(Command(3, "d", 4), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Command(71, std::string(2048, 'x')), absl::StatusCode::kInvalidArgument);
  Step();
  EXPECT_THAT(got, ElementsAre("a", "b", "c"));
  for (std::uint32_t i = 0; i < game::kMaxWaitingCommands; ++i) ASSERT_EQ(Command(71 + i, "e"), absl::StatusCode::kOk);
  EXPECT_EQ(Command(71 + game::kMaxWaitingCommands, "f"), absl::StatusCode::kResourceExhausted);
}

// The client shows already what it asks for, as of that input.
TEST_F(RegionTalkTest, ACommandWithAnInputIsGivenInTheTickInWhichThatActs) {
  std::vector<std::uint64_t> got;
  game.On(game::kOnCommand, "", [&](GameCalls&, Arguments) {
    got.push_back(one->tick().value());
    return true;
  });
  Begin();
  Step();
  ASSERT_TRUE(one->TakeCommand(kTalker, {1, 1, "throw", 0, 2}).ok());
  Steps(2);
  EXPECT_THAT(got, IsEmpty());
  for (const std::uint32_t number : {1U, 2U}) {
    PlayerInput input;
    input.number = number;
    input.player = kTalker;
    input.body = kTalkersBody;
    ASSERT_TRUE(one->QueueInput(input).ok());
  }
  while (one->LastInput(kTalker) < 2) {
    EXPECT_THAT(got, IsEmpty());
    ASSERT_LT(one->tick(), Tick(20));
    Step();
  }
  EXPECT_THAT(got, SizeIs(1)) << "in the very tick";
  ASSERT_TRUE(one->TakeCommand(kTalker, {1, 2, "throw", 0, 1000}).ok());
  Steps(static_cast<int>(game::kMaxCommandWait_ticks) - 1);
  EXPECT_THAT(got, SizeIs(1));
  Steps(2);
  EXPECT_THAT(got, SizeIs(2)) << "an input that never comes is not waited for";
}

// The client may hear of the body first from the region that it has flown to, or after a restore.
TEST_F(RegionTalkTest, ABodyOfACommandSaysSoInItsNextRegionAndInASavedState) {
  BodyId made;
  game.On(game::kOnCommand, "", [&](GameCalls& calls, Arguments) {
    const game::NamedFields options{{"predicted", game::ToInterface(game::GameValue(kTalker))},
                                    {"velocity", game::ToInterface(game::GameValue(Vec3d{4, 0, 0}))}};
    const game::GameValue name(std::string("ball")), place(Vec3d{-0.6, 0, 5});
    EXPECT_TRUE(calls.CallRaw(game::kWorldSpawn,
                              std::vector{game::ToInterface(name), game::ToInterface(place), options.value()}))
        << calls.error();
    made = BodyId(calls.result().as.id);
    return true;
  });
  Begin();
  Step();
  ASSERT_TRUE(one->TakeCommand(kTalker, {1, 1, "throw", 0, 1000}).ok());
  Steps(60);
  ASSERT_TRUE(two->Owns(made));
  const auto claim_in = [&](const game::GameRecord& record) { return record.tuning.claim.value_or(SpawnClaim{}); };
  ASSERT_NE(two->records().Find(made), nullptr);
  EXPECT_EQ(claim_in(two->records().Find(made)->game), (SpawnClaim{kTalker, 1}));
  const auto state = DecodeState(two->SaveState(), two->catalog());
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_EQ(claim_in(state->records.at(made).game), (SpawnClaim{kTalker, 1}));
}

TEST_F(RegionTalkTest, AWorldWithoutAGameTakesNone) {
  Begin(false);
  Step();
  EXPECT_EQ(Command(1, "a"), absl::StatusCode::kFailedPrecondition);
  ASSERT_NE(one->TalkOf(kTalker), nullptr);
  EXPECT_EQ(*one->TalkOf(kTalker), PlayerRecord());
}

TEST_F(RegionTalkTest, NumbersEventsAndStageGoAlongToAnotherRegion) {
  HandleTicks();
  Begin();
  Step();
  ASSERT_EQ(Command(1, "a"), absl::StatusCode::kOk);
  Do(game::kPlayerSend, {std::string("score")});
  Step();
  one->AcknowledgeEvents(kTalker, 5);
  ASSERT_THAT(one->TalkOf(kTalker)->events, SizeIs(1)) << "a number that was never given";
  Do(game::kPlayerSpectate, {Vec3d{5, 0, 5}});
  Steps(6);
  ASSERT_TRUE(two->Owns(kTalkersBody)) << "it goes where the player looks from";
  EXPECT_EQ(Command(1, "a"), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(two->TalkOf(kTalker)->last_event, 1U);
  EXPECT_TRUE(two->IsHidden(kTalkersBody));
  EXPECT_TRUE(two->world().IsParked(kTalkersBody));
  EXPECT_EQ(one->ghost_count(), 0U);
  two->AcknowledgeEvents(kTalker, 1);
  Step();
  EXPECT_THAT(two->TalkOf(kTalker)->events, IsEmpty());
  EXPECT_EQ(two->TalkOf(kTalker)->last_event, 1U);
}

TEST_F(RegionTalkTest, ASpectatorComesBackWhereTheGameSays) {
  HandleTicks();
  Begin();
  Step();
  Do(game::kPlayerSpectate, {Vec3d{-5, 5, -5}});
  Steps(3);
  ASSERT_TRUE(one->IsHidden(kTalkersBody));
  const Vec3d before = one->world().StateOf(kTalkersBody).position;
  Steps(3);
  EXPECT_EQ(one->world().StateOf(kTalkersBody).position, before);
  Do(game::kPlayerRespawn, {Vec3d{-0.6, 0, 0}});
  Steps(2);
  EXPECT_FALSE(one->IsHidden(kTalkersBody));
  EXPECT_FALSE(one->world().IsParked(kTalkersBody));
  EXPECT_NEAR(one->world().StateOf(kTalkersBody).position.x, -0.6, 0.01);
  Steps(3);
  EXPECT_EQ(two->ghost_count(), 1U) << "neighbours see it again";
}

TEST_F(RegionTalkTest, ACheckpointKeepsNameAndTalk) {
  HandleTicks();
  Begin();
  Step();
  ASSERT_EQ(Command(1, "a"), absl::StatusCode::kOk);
  Do(game::kPlayerSend, {std::string("score")});
  Step();
  const auto state = DecodeState(one->SaveState(), one->catalog());
  ASSERT_TRUE(state.ok()) << state.status();
  const CarriedRecord record = state->RecordOf(kTalkersBody);
  EXPECT_EQ(record.game.player->last_command, 1U);
  EXPECT_THAT(record.game.player->events, SizeIs(1));
  EXPECT_EQ(PropertySet::Decode(record.bytes, {})->player_name(), "ada");
}

}  // namespace
}  // namespace tessera::region
