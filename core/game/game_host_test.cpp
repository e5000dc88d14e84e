#include "core/game/game_host.h"

#include <gmock/gmock.h>

#include <limits>
#include <string>
#include <vector>

#include "core/game/testing/game_host_fixture.h"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(GameHostTest, AnInspectionReadsAndChangesNothing) {
  world.Add(1, kCrate);
  Load();
  Run();
  host->Inspect(tick, world, [&](const tessera_game_host& functions, tessera_game_call* call) {
    GameCalls calls(functions, call);
    ASSERT_TRUE(calls.Call(kWorldTick, {}));
    EXPECT_EQ(calls.result().as.whole, 1);
    ASSERT_TRUE(calls.Call(kBodySet, {BodyId(1), std::string("health"), std::int64_t{7}}));
    ASSERT_TRUE(calls.Call(kBodyGet, {BodyId(1), std::string("health")}));
    EXPECT_EQ(calls.result().as.whole, 7) << "within itself";
    EXPECT_FALSE(calls.Call(kBodyGet, {BodyId(1), std::string("mana")}));
  });
  EXPECT_EQ(world.property(1, "health"), PropertyValue(std::int64_t{100}));
  EXPECT_EQ(world.commits(), 0);
}

TEST_F(GameHostTest, CallsWhatTheKindHasAndNothingElse) {
  world.Add(1, kCrate);
  world.Add(2, kBallKind);
  world.Add(3, 0);
  std::vector<std::uint64_t> called;
  game.On(kOnBodyContact, "crate", [&](GameCalls&, Arguments arguments) {
    called.push_back(arguments[0].as.id * 10 + arguments[1].as.id);
    return true;
  });
  Load();
  Run({Contact(1, 2), Contact(2, 1), Contact(3, 1), Contact(1, 3)});
  EXPECT_THAT(called, ElementsAre(12, 13));
  EXPECT_EQ(host->statistics().calls, 2U);
}

TEST_F(GameHostTest, AnEventOfABodyThatIsNotOwnedIsItsOwners) {
  world.Add(1, kCrate, false);
  game.On(kOnBodyContact, "crate", [](GameCalls&, Arguments) { return true; });
  Load();
  Run({Contact(1, 2), Contact(77, 1)});
  EXPECT_EQ(host->statistics().calls, 0U);
}

// The owner of the lower body of a pair has the reports of both.
TEST_F(GameHostTest, AnEventOfANeighboursBodyGoesThereByAMessageOfTheLowerOne) {
  std::vector<std::string> called;
  const auto note = [&](const char* what) {
    return [&called, what](GameCalls&, Arguments arguments) {
      called.push_back(what + std::to_string(arguments[0].as.id) + std::to_string(arguments[1].as.id));
      return true;
    };
  };
  world.Add(1, kCrate);
  world.Add(2, kBallKind, false);
  game.On(kOnBodyContact, "ball", [&](GameCalls& calls, Arguments arguments) {
    EXPECT_EQ(FieldsFrom(arguments[2]).value()[0].second, GameValue(7.0));
    return note("met ")(calls, arguments);
  });
  game.On(kOnBodyContactEnded, "ball", note("left "));
  Load();
  GameEvent met = Contact(2, 1), back = Contact(1, 2);
  met.contact = {{1, 2, 3}, {0, 1, 0}, 7};
  Run({back, met});
  EXPECT_THAT(called, IsEmpty());
  ASSERT_EQ(world.record(1).mail.outbox.size(), 1U) << "and none where the kind does not ask";
  const SentMessage sent = world.record(1).mail.outbox[0];
  EXPECT_EQ(sent.target, BodyId(2));
  EXPECT_EQ(sent.made, tick);

  // Body 2 comes here before the message does. That they parted is not told before that they met.
  world.Add(2, kBallKind);
  Run({{kOnBodyContactEnded, BodyId(2), BodyId(1)}});
  Run();
  Run();
  EXPECT_THAT(called, IsEmpty());
  GameRecord record = world.record(2);
  record.mail.Take({BodyId(1), sent.number, sent.after, sent.made, tick + 1, 1, sent.what}, tick);
  world.Commit(BodyId(2), {}, record, false);
  GameRecord reporter = world.record(1);
  reporter.mail.Acknowledged(BodyId(2), sent.number);
  world.Commit(BodyId(1), {}, reporter, false);
  Run();
  EXPECT_THAT(called, ElementsAre("met 21", "left 21"));
  // Then nothing is under way, and events are called at once again.
  Run({met});
  EXPECT_THAT(called, ElementsAre("met 21", "left 21", "met 21"));
  Run();
  EXPECT_THAT(Lines(), IsEmpty());
}

TEST_F(GameHostTest, AnEventThatFindsNoRoomForItsMessageIsCounted) {
  world.Add(1, kCrate);
  world.Add(2, kBallKind, false);
  game.On(kOnBodyContact, "ball", [](GameCalls&, Arguments) { return true; });
  Load();
  for (std::size_t i = 0; i < kMaxOutbox + 3; ++i) Run({Contact(2, 1)});
  EXPECT_EQ(world.record(1).mail.outbox.size(), kMaxOutbox);
  EXPECT_EQ(host->statistics().dropped_events, 3U);
}

TEST_F(GameHostTest, EffectsOfACallAreThereForTheNext) {
  world.Add(1, kCrate);
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments arguments) {
    EXPECT_TRUE(calls.Call(kBodyGet, {BodyId(1), std::string("health")}));
    const std::int64_t health = calls.result().as.whole;
    EXPECT_EQ(arguments[0].as.id, 1U);
    EXPECT_TRUE(calls.Call(kBodySet, {BodyId(1), std::string("health"), health - 30}));
    EXPECT_TRUE(calls.Call(kBodyGet, {BodyId(1), std::string("health")}));
    EXPECT_EQ(calls.result().as.whole, health - 30) << "it reads what it wrote";
    return true;
  });
  Load();
  Run({Contact(1, 2), Contact(1, 3)});
  EXPECT_EQ(world.property(1, "health"), PropertyValue(std::int64_t{40}));
}

TEST_F(GameHostTest, NothingIsToldOfMeetingABodyThatAnEarlierCallbackRemoved) {
  world.Add(1, kCrate);
  world.Add(2, kCrate);
  int calls_made = 0;
  game.On(kOnBodyContact, "crate", [&](GameCalls& calls, Arguments arguments) {
    ++calls_made;
    return calls.Call(kBodyRemove, {BodyId(arguments[1].as.id)});
  });
  Load();
  Run({Contact(1, 2), Contact(2, 1), Contact(1, 2)});
  EXPECT_EQ(calls_made, 1);
  EXPECT_EQ(host->statistics().errors, 0U);
}

TEST_F(GameHostTest, ACallThatFailsLeavesNothingBehind) {
  world.Add(1, kCrate);
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(kBodySet, {BodyId(1), std::string("health"), std::int64_t{1}}));
    EXPECT_TRUE(calls.Call(kBodyImpulse, {BodyId(1), Vec3d{1, 0, 0}}));
    EXPECT_TRUE(calls.Call(kBodyAfter, {BodyId(1), std::int64_t{5}, std::string("soon")}));
    EXPECT_TRUE(calls.Call(kWorldLog, {std::string("never said")}));
    return false;
  });
  Load();
  Run({Contact(1, 2)});
  EXPECT_EQ(world.property(1, "health"), PropertyValue(std::int64_t{100}));
  EXPECT_TRUE(world.record(1).empty());
  EXPECT_THAT(Lines(), ElementsAre("error: game.lua:7: it failed"));
  EXPECT_EQ(host->statistics().errors, 1U);
}

TEST_F(GameHostTest, ATimerIsCalledOnceWhenItIsDueWithItsValues) {
  world.Add(1, kCrate);
  std::vector<std::string> called;
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    const tessera_game_field fields[] = {{"big", 3, ToInterface(GameValue(true))},
                                         {"to", 2, ToInterface(GameValue(BodyId(9)))}};
    tessera_game_value values[4] = {ToInterface(GameValue(BodyId(1))), ToInterface(GameValue(std::int64_t{3})), {}, {}};
    values[2].type = TESSERA_GAME_TEXT;
    values[2].count = 4;
    values[2].as.text = "boom";
    values[3].type = TESSERA_GAME_FIELDS;
    values[3].count = 2;
    values[3].as.fields = fields;
    return calls.CallRaw(kBodyAfter, values);
  });
  game.On(kOnBodyTimer, "crate", [&](GameCalls&, Arguments arguments) {
    called.emplace_back(arguments[1].as.text, arguments[1].count);
    EXPECT_EQ(arguments[2].count, 2U);
    EXPECT_EQ(std::string(arguments[2].as.fields[1].name, arguments[2].as.fields[1].name_bytes), "to");
    EXPECT_EQ(arguments[2].as.fields[1].value.as.id, 9U);
    return true;
  });
  Load();
  Run({Contact(1, 2)});
  EXPECT_EQ(world.record(1).timers.size(), 1U);
  Run();
  Run();
  EXPECT_THAT(called, IsEmpty());
  Run();
  EXPECT_THAT(called, ElementsAre("boom"));
  Run();
  EXPECT_EQ(called.size(), 1U);
  EXPECT_THAT(world.record(1).timers, IsEmpty());
}

TEST_F(GameHostTest, ATimerWhoseCallbackFailsOrIsMissingIsOver) {
  world.Add(1, kCrate);
  world.Add(2, kBallKind);
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kBodyAfter, {BodyId(1), std::int64_t{1}, std::string("fails")}) &&
           calls.Call(kBodyAfter, {BodyId(2), std::int64_t{1}, std::string("is missing")});
  });
  game.On(kOnBodyTimer, "crate", [](GameCalls&, Arguments) { return false; });
  Load();
  Run({Contact(1, 2)});
  Run();
  EXPECT_THAT(world.record(1).timers, IsEmpty());
  EXPECT_THAT(world.record(2).timers, IsEmpty());
  EXPECT_EQ(host->statistics().errors, 1U);
}

TEST_F(GameHostTest, ATimerThatIsTakenBackByAnEarlierOneIsNotCalled) {
  world.Add(1, kCrate);
  int called = 0;
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kBodyAfter, {BodyId(1), std::int64_t{1}, std::string("first")}) &&
           calls.Call(kBodyAfter, {BodyId(1), std::int64_t{1}, std::string("second")});
  });
  game.On(kOnBodyTimer, "crate", [&](GameCalls& calls, Arguments) {
    ++called;
    EXPECT_TRUE(calls.Call(kBodyCancel, {BodyId(1), std::int64_t{2}}));
    EXPECT_EQ(calls.result().as.whole, 1);
    EXPECT_TRUE(calls.Call(kBodyCancel, {BodyId(1), std::int64_t{2}}));
    EXPECT_EQ(calls.result().as.whole, 0) << "it is gone";
    return true;
  });
  Load();
  Run({Contact(1, 2)});
  Run();
  Run();
  EXPECT_EQ(called, 1);
}

TEST_F(GameHostTest, AnImpulseOffTheCentreTurnsTheBodyToo) {
  world.Add(1, kCrate);
  world.state(1).position = {10, 0, 0};
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kBodyImpulse, {BodyId(1), Vec3d{0, 4, 0}, Vec3d{12, 0, 0}});
  });
  Load();
  Run({Contact(1, 2)});
  EXPECT_EQ(world.record(1).push_ns, (Vec3f{0, 4, 0}));
  EXPECT_EQ(world.record(1).push_nms, (Vec3f{0, 0, 8})) << "(2, 0, 0) x (0, 4, 0)";
}

TEST_F(GameHostTest, SetVelocityReplacesEarlierPushes) {
  world.Add(1, kCrate);
  world.state(1).linear_velocity = {3, 0, 0};
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kBodyImpulse, {BodyId(1), Vec3d{0, 50, 0}}) &&
           calls.Call(kBodySetVelocity, {BodyId(1), Vec3d{0, 5, 0}});
  });
  Load();
  Run({Contact(1, 2)});
  EXPECT_EQ(world.record(1).push_ns, (Vec3f{-6, 10, 0})) << "2 kg from (3, 0, 0) to (0, 5, 0) m/s";
}

TEST_F(GameHostTest, WrongArgumentsAreNamed) {
  world.Add(1, kCrate);
  world.Add(2, kCrate, false);
  std::vector<std::string> errors;
  game.On(kOnBodyContact, "crate", [&](GameCalls& calls, Arguments) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
    const auto refused = [&](std::uint32_t function, const std::vector<GameValue>& arguments) {
      EXPECT_FALSE(calls.Call(function, arguments)) << function;
      errors.push_back(calls.error());
    };
    refused(kBodyImpulse, {BodyId(1), std::string("up")});
    refused(kBodyImpulse, {BodyId(1), Vec3d{nan, 0, 0}});
    refused(kBodyImpulse, {BodyId(1), Vec3d{0, infinite, 0}});
    refused(kBodyImpulse, {BodyId(1)});
    refused(kBodyImpulse, {BodyId(1), Vec3d{1, 0, 0}, Vec3d{1, 0, 0}, true});
    refused(kBodyImpulse, {BodyId(1), Vec3d{1e9, 0, 0}});
    refused(kBodyCancel, {BodyId(2), std::int64_t{1}});
    refused(kBodyPosition, {BodyId(77)});
    refused(kBodyPosition, {std::int64_t{1}});
    refused(kBodyGet, {BodyId(1), std::string("mana")});
    refused(kBodySet, {BodyId(1), std::string("health"), std::string("full")});
    refused(kBodySet, {BodyId(1), std::string("heat"), nan});
    refused(kBodyAfter, {BodyId(1), std::int64_t{0}, std::string("now")});
    refused(kBodyAfter, {BodyId(1), std::int64_t{1}, std::string(33, 'x')});
    refused(9999, {});
    return true;
  });
  Load();
  Run({Contact(1, 2)});
  EXPECT_THAT(
      errors,
      ElementsAre("impulse: `impulse` must be a vector, got a text", "impulse: `impulse` is not finite",
                  "impulse: `impulse` is not finite", "impulse: `impulse` is missing",
                  "impulse: takes 2 arguments, got 3", "impulse: makes a body of 2 kg faster by more than 1000 m/s",
                  "cancel: body 2 is not owned by this region", "position: body 77 is not here",
                  "position: is called for a body",
                  "get: no property \"mana\"; the scene declares: health, name, heat, on, home, target, note",
                  HasSubstr("\"health\" is a whole number"), "set: `value` is not finite",
                  "after: `ticks` must be 1 to 1000000, got 0", "after: `name` must have 1 to 32 bytes",
                  "there is no function 9999"));
  EXPECT_EQ(host->statistics().errors, 0U) << "the game may go on after a call that was refused";
}

TEST_F(GameHostTest, ABodyHasAFewTimersAndNoMore) {
  world.Add(1, kCrate);
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    for (std::size_t i = 0; i < kMaxTimers; ++i) {
      EXPECT_TRUE(calls.Call(kBodyAfter, {BodyId(1), static_cast<std::int64_t>(20 - i), std::string("t")}));
    }
    EXPECT_FALSE(calls.Call(kBodyAfter, {BodyId(1), std::int64_t{1}, std::string("t")}));
    EXPECT_EQ(calls.error(), "after: the body has 16 timers already");
    return true;
  });
  Load();
  Run({Contact(1, 2)});
  EXPECT_EQ(world.record(1).timers.size(), kMaxTimers);
  EXPECT_TRUE(CheckRecord(world.record(1)).ok()) << CheckRecord(world.record(1));
}

TEST_F(GameHostTest, MoreWorkThanACallMayDoIsDiscarded) {
  world.Add(1, kCrate);
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(kBodySet, {BodyId(1), std::string("on"), true}));
    EXPECT_TRUE(calls.Charge(20'000));
    EXPECT_FALSE(calls.Charge(1));
    EXPECT_FALSE(calls.Charge(std::numeric_limits<std::uint64_t>::max())) << "it does not wrap";
    return true;
  });
  Load();
  Run({Contact(1, 2)});
  EXPECT_EQ(world.property(1, "on"), PropertyValue(false));
  EXPECT_THAT(Lines(), ElementsAre("error: too much work"));
}

TEST_F(GameHostTest, EventsBeyondATicksWorkWaitInTheirOrder) {
  for (std::uint64_t id = 1; id <= 5; ++id) world.Add(id, kCrate);
  std::vector<std::uint64_t> called;
  game.On(kOnBodyContact, "crate", [&](GameCalls& calls, Arguments arguments) {
    called.push_back(arguments[0].as.id);
    return calls.Charge(10'000);
  });
  Load({.instructions_per_tick = 15'000});
  Run({Contact(1, 9), Contact(2, 9), Contact(3, 9), Contact(4, 9), Contact(5, 9)});
  EXPECT_THAT(called, ElementsAre(1, 2));
  world.Lose(3);
  Run({Contact(1, 8)});
  EXPECT_THAT(called, ElementsAre(1, 2, 4, 5)) << "3 is another region's by now";
  Run();
  EXPECT_THAT(called, ElementsAre(1, 2, 4, 5, 1));
}

TEST_F(GameHostTest, TicksOfBodiesGoOnWhereTheBudgetEnded) {
  for (std::uint64_t id = 1; id <= 5; ++id) world.Add(id, id == 4 ? kBallKind : kCrate);
  std::vector<std::uint64_t> called;
  game.On(kOnBodyTick, "crate", [&](GameCalls& calls, Arguments arguments) {
    called.push_back(arguments[0].as.id);
    return calls.Charge(10'000);
  });
  Load({.instructions_per_tick = 15'000});
  EXPECT_TRUE(host->ticks());
  for (int i = 0; i < 4; ++i) Run();
  EXPECT_THAT(called, ElementsAre(1, 2, 3, 5, 1, 2, 3, 5));
}

TEST_F(GameHostTest, ACallbackThatFailsTooOftenInARowIsOff) {
  world.Add(1, kCrate);
  world.Add(2, kBallKind);
  int crates = 0, balls = 0;
  game.On(kOnBodyTick, "crate", [&](GameCalls&, Arguments) { return ++crates % 3 == 0; });
  game.On(kOnBodyTick, "ball", [&](GameCalls&, Arguments) {
    ++balls;
    return false;
  });
  Load({.failures_until_off = 5});
  for (int i = 0; i < 20; ++i) Run();
  EXPECT_EQ(balls, 5);
  EXPECT_EQ(crates, 20);
  EXPECT_EQ(host->statistics().callbacks_off, 1U);
  EXPECT_THAT(Lines(), ::testing::Contains("error: kinds.ball.on_tick failed 5 times in a row and is off"));
}

TEST_F(GameHostTest, RandomNumbersFollowFromWorldBodyAndTick) {
  world.Add(1, kCrate);
  world.Add(2, kCrate);
  std::vector<double> drawn;
  game.On(kOnBodyTick, "crate", [&](GameCalls& calls, Arguments) {
    for (int i = 0; i < 2; ++i) {
      EXPECT_TRUE(calls.Call(kWorldRandom, {}));
      drawn.push_back(calls.result().as.real);
    }
    return true;
  });
  Load();
  Run();
  Run();
  const std::vector<double> first = std::exchange(drawn, {});
  EXPECT_THAT(first, ::testing::Each(::testing::AllOf(::testing::Ge(0.0), ::testing::Lt(1.0))));
  std::vector<double> sorted = first;
  std::ranges::sort(sorted);
  EXPECT_EQ(std::ranges::adjacent_find(sorted), sorted.end()) << "all differ";
  tick = Tick();
  ASSERT_TRUE(host->Renew().ok());
  Run();
  Run();
  EXPECT_EQ(drawn, first);
}

TEST_F(GameHostTest, AFloodOfEventsAndLinesIsBounded) {
  world.Add(1, kCrate);
  game.On(kOnBodyContact, "crate",
          [](GameCalls& calls, Arguments) { return calls.Call(kWorldLog, {std::string(1000, 'x')}); });
  Load();
  Run(std::vector<GameEvent>(kMaxWaitingEvents + 7, Contact(1, 2)));
  EXPECT_EQ(host->statistics().dropped_events, 7U);
  const std::vector<GameLine> lines = host->TakeLines();
  ASSERT_EQ(lines.size(), kMaxLogLinesPerTick);
  EXPECT_EQ(lines[0].text.size(), kMaxLogLineBytes);
  EXPECT_GT(host->statistics().dropped_lines, 0U);
}

TEST_F(GameHostTest, AModuleThatDoesNotLoadSaysWhy) {
  const tessera_game_module module = game.module();
  const auto broken = GameHost::Load(module, {"game.lua", "broken"}, world.shared_scene());
  EXPECT_EQ(broken.status(), absl::InvalidArgumentError("game.lua:1: it is broken"));
  tessera_game_module other = module;
  other.abi = 7;
  const auto foreign = GameHost::Load(other, {"game.so", ""}, world.shared_scene());
  EXPECT_EQ(foreign.status(),
            absl::InvalidArgumentError("game.so: is made for version 7 of the interface, and this is version 1"));
}

TEST_F(GameHostTest, CodeThatIsLoadedAnewGoesOnWithWhatRecordsHold) {
  world.Add(1, kCrate);
  int called = 0;
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kBodyAfter, {BodyId(1), std::int64_t{2}, std::string("t")});
  });
  game.On(kOnBodyTimer, "crate", [&](GameCalls&, Arguments) { return ++called > 0; });
  Load();
  Run({Contact(1, 2)});
  ASSERT_TRUE(host->Renew().ok());
  EXPECT_EQ(game.loads(), 2);
  Run();
  Run();
  EXPECT_EQ(called, 1);
}

TEST_F(GameHostTest, WhatOneCallDoesToSeveralBodiesGoesTogether) {
  world.Add(1, kCrate);
  world.Add(2, kBallKind);
  const auto hurt = [](GameCalls& calls, std::uint64_t id) {
    return calls.Call(kBodySet, {BodyId(id), std::string("health"), std::int64_t{7}});
  };
  bool both = true;
  game.On(kOnBodyContact, "crate",
          [&](GameCalls& calls, Arguments) { return hurt(calls, 1) && (!both || hurt(calls, 2)); });
  Load();
  Run({Contact(1, 2)});
  EXPECT_TRUE(world.together(1));
  EXPECT_TRUE(world.together(2));
  both = false;
  Run({Contact(1, 2)});
  EXPECT_FALSE(world.together(1));
}

TEST_F(GameHostTest, RegionsDrawOtherNumbersForTheWorldAndTheSameForABody) {
  std::vector<double> of_world, of_body;
  const auto draw = [](std::vector<double>& numbers) {
    return [&numbers](GameCalls& calls, Arguments) {
      EXPECT_TRUE(calls.Call(kWorldRandom, {}));
      numbers.push_back(calls.result().as.real);
      return true;
    };
  };
  game.On(kOnTick, "", draw(of_world));
  game.On(kOnBodyTick, "crate", draw(of_body));
  world.Add(1, kCrate);
  Load();
  for (const std::uint32_t region : {1, 2, 1}) {
    world.set_region(region);
    tick = Tick(4);
    Run();
  }
  ASSERT_EQ(of_world.size(), 3U);
  EXPECT_NE(of_world[0], of_world[1]);
  EXPECT_EQ(of_world[0], of_world[2]);
  EXPECT_EQ(of_body[0], of_body[1]);
}

}  // namespace
}  // namespace tessera::game
