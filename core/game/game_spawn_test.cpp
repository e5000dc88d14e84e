// Bodies that a game makes.
#include <gmock/gmock.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/game/testing/game_host_fixture.h"
#include "core/game/testing/named_fields.h"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class SpawnTest : public GameHostTest {
 protected:
  // A callback of body 1, once a tick.
  void OnTick(ScriptedGame::Handler handler) {
    world.Add(1, kCrate);
    game.On(kOnBodyTick, "crate", std::move(handler));
  }
  static BodyId Made(std::uint32_t count, std::uint32_t prefab = 0, std::uint32_t member = 0) {
    return SpawnedBodyId({prefab, 1, count, member});
  }
};

TEST_F(SpawnTest, ABodyIsThereForTheRestOfTheCallAndAfterIt) {
  OnTick([](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(kWorldSpawn, {std::string("ball"), Vec3d{1, 2, 3}})) << calls.error();
    const BodyId ball(calls.result().as.id);
    EXPECT_TRUE(calls.Call(kBodyPosition, {ball}));
    EXPECT_EQ(calls.result().as.vector[2], 3);
    EXPECT_TRUE(calls.Call(kBodyIsOwn, {ball}));
    EXPECT_EQ(calls.result().as.whole, 1);
    return calls.Call(kBodySet, {ball, std::string("health"), std::int64_t{7}}) &&
           calls.Call(kBodyImpulse, {ball, Vec3d{0, 4, 0}});
  });
  Load();
  Run();
  EXPECT_THAT(world.ids(), ElementsAre(BodyId(1), Made(1)));
  EXPECT_EQ(world.property(Made(1).value(), "health"), PropertyValue(std::int64_t{7}));
  EXPECT_EQ(world.record(Made(1).value()).push_ns, (Vec3f{0, 4, 0}));
  EXPECT_EQ(world.state(Made(1).value()).position, (Vec3d{1, 2, 3}));
  EXPECT_EQ(host->statistics().spawned, 1U);
}

TEST_F(SpawnTest, NothingIsLeftOfAFailedCall) {
  OnTick([](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(kWorldSpawn, {std::string("train"), Vec3d()}));
    EXPECT_TRUE(calls.Call(kBodyRemove, {BodyId(1)}));
    return false;
  });
  Load();
  Run();
  EXPECT_THAT(world.ids(), ElementsAre(BodyId(1)));
}

TEST_F(SpawnTest, OfSeveralBodiesEachHasANumber) {
  OnTick([](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(kWorldSpawn, {std::string("train"), Vec3d{5, 0, 0}}));
    const BodyId engine(calls.result().as.id);
    EXPECT_TRUE(calls.Call(kBodyMember, {engine, std::int64_t{4}}));
    EXPECT_EQ(calls.result().type, TESSERA_GAME_NOTHING);
    EXPECT_TRUE(calls.Call(kBodyMember, {engine, std::int64_t{3}}));
    return calls.Call(kBodyRemove, {BodyId(calls.result().as.id)});
  });
  Load();
  Run();
  EXPECT_THAT(world.ids(), ElementsAre(BodyId(1), Made(1, 1, 0), Made(1, 1, 1)));
  EXPECT_EQ(world.state(Made(1, 1, 1).value()).position.x, 6);
}

TEST_F(SpawnTest, ARemovedBodyIsGoneForTheRestOfTheCall) {
  OnTick([](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(kBodyRemove, {BodyId(1)}));
    EXPECT_FALSE(calls.Call(kBodyPosition, {BodyId(1)}));
    EXPECT_EQ(calls.error(), "position: body 1 is not here");
    return true;
  });
  Load();
  Run();
  EXPECT_THAT(world.ids(), IsEmpty());
  Run();
  EXPECT_EQ(host->statistics().calls, 1U);
}

TEST_F(SpawnTest, ABodyExpiresWithItsTimers) {
  OnTick([](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(kWorldTick, {}));
    if (calls.result().as.whole != 1) return true;
    return calls.Call(kBodyExpireAfter, {BodyId(1), std::int64_t{3}}) &&
           calls.Call(kBodyAfter, {BodyId(1), std::int64_t{3}, std::string("late")});
  });
  int timers = 0;
  game.On(kOnBodyTimer, "crate", [&](GameCalls&, Arguments) { return ++timers > 0; });
  Load();
  for (int i = 0; i < 3; ++i) Run();
  EXPECT_THAT(world.ids(), ElementsAre(BodyId(1)));
  Run();
  EXPECT_THAT(world.ids(), IsEmpty());
  EXPECT_EQ(timers, 0);
  EXPECT_EQ(host->statistics().expired, 1U);
}

TEST_F(SpawnTest, AMillionSpawnsEndAtTheTicksLimit) {
  OnTick([](GameCalls& calls, Arguments) {
    int made = 0;
    while (calls.Call(kWorldSpawn, {std::string("ball"), Vec3d()})) ++made;
    EXPECT_EQ(made, 4);
    EXPECT_EQ(calls.error(), "spawn: more bodies than a region may make in a tick");
    return true;
  });
  GameSettings settings;
  settings.spawns_per_tick = 4;
  settings.bodies_per_region = 9;
  Load(settings);
  Run();
  Run();
  EXPECT_EQ(world.ids().size(), 9U);
}

TEST_F(SpawnTest, WhatCannotBeMadeIsRefusedByName) {
  OnTick([](GameCalls& calls, Arguments) {
    const auto refused = [&](const std::string& prefab, Vec3d place) {
      EXPECT_FALSE(calls.Call(kWorldSpawn, {prefab, place}));
      return calls.error();
    };
    EXPECT_EQ(refused("bal", {}), "spawn: no prefab \"bal\"; the scene has: ball, train");
    EXPECT_EQ(refused("ball", {0, 101, 0}), "spawn: (0, 101, 0) is outside the scene's bounds");
    const auto with = [&](const char* name, const GameValue& value) {
      const tessera_game_field field{name, std::string_view(name).size(), ToInterface(value)};
      tessera_game_value options{};
      options.type = TESSERA_GAME_FIELDS;
      options.count = 1;
      options.as.fields = &field;
      const GameValue prefab(std::string("ball")), place(Vec3d{});
      const tessera_game_value arguments[] = {ToInterface(prefab), ToInterface(place), options};
      EXPECT_FALSE(calls.CallRaw(kWorldSpawn, arguments));
      return calls.error();
    };
    EXPECT_EQ(with("velocity", Vec3d{0, 0, 2000}), "spawn: `options.velocity` is above 1000 m/s");
    EXPECT_EQ(with("velocity", Vec3d{0, 0, std::numeric_limits<double>::quiet_NaN()}),
              "spawn: `options.velocity` is not finite");
    EXPECT_EQ(with("speed", Vec3d{}),
              "spawn: `options.speed` is none of rotation, velocity, spin, expire_after, predicted");
    EXPECT_EQ(with("expire_after", std::int64_t{0}), "spawn: `options.expire_after` must be 1 to 1000000, got 0");
    return true;
  });
  Load();
  Run();
  EXPECT_EQ(host->statistics().calls, 1U);
  EXPECT_THAT(world.ids(), ElementsAre(BodyId(1)));
}

// The record of the body says to whose client it belongs, and by which of its commands.
class PredictedSpawnTest : public SpawnTest {
 protected:
  static constexpr PlayerNumber kAda{3};
  PredictedSpawnTest() { world.AddPlayer(3, "ada"); }
  // Two commands wait, of which the second has the number 7; it goes with an input that has acted.
  void Give(bool predicted) {
    world.input = PlayerInput{.number = 20};
    PlayerRecord& talk = world.AddPlayer(3, "ada").player.Change();
    talk.last_command = 7;
    talk.commands = {"look", "throw"};
    if (predicted) talk.commands[1].with_input = 20;
  }
  // A prefab of this name, made for this player.
  static bool Spawn(GameCalls& calls, const std::string& prefab, PlayerNumber player) {
    const NamedFields options{{"predicted", ToInterface(GameValue(player))}};
    const GameValue name(prefab), place(Vec3d{0, 1, 0});
    return calls.CallRaw(kWorldSpawn, std::vector{ToInterface(name), ToInterface(place), options.value()});
  }
  // Errors of the calls for these, in the second command.
  std::vector<std::string> Said(const std::vector<std::pair<std::string, PlayerNumber>>& asked) {
    std::vector<std::string> said;
    game.On(kOnCommand, "", [&](GameCalls& calls, Arguments arguments) {
      if (arguments[1].count != 5) return true;
      for (const auto& [prefab, player] : asked) said.push_back(Spawn(calls, prefab, player) ? "" : calls.error());
      return true;
    });
    Load();
    Run();
    return said;
  }
};

TEST_F(PredictedSpawnTest, TheBodyOfACommandSaysWhoseAndWhichItIs) {
  Give(true);
  EXPECT_THAT(Said({{"ball", kAda}}), ElementsAre(""));
  const std::optional<SpawnClaim>& claim = world.record(Made(1).value()).tuning.claim;
  ASSERT_TRUE(claim.has_value());
  EXPECT_EQ(*claim, (SpawnClaim{kAda, 7}));
}

TEST_F(PredictedSpawnTest, WhereTheClientShowsNothingNothingIsSaid) {
  Give(false);
  EXPECT_THAT(Said({{"ball", kAda}}), ElementsAre(""));
  EXPECT_FALSE(world.record(Made(1).value()).tuning.claim.has_value());
}

TEST_F(PredictedSpawnTest, OneBodyOfOnePrefabForThePlayerOfTheCommand) {
  Give(true);
  EXPECT_THAT(Said({{"ball", PlayerNumber(4)}, {"train", kAda}, {"ball", kAda}, {"ball", kAda}}),
              ElementsAre("spawn: `options.predicted` must be the player whose command on_command has got",
                          HasSubstr("`options.predicted` is for prefabs of one body, and \"train\" has "), "",
                          "spawn: `options.predicted` is for one body of a command, and there is one"));
  EXPECT_FALSE(world.ids().empty());
}

TEST_F(PredictedSpawnTest, OnlyACommandSaysWhoseABodyIs) {
  std::string said;
  game.On(kOnTick, "", [&](GameCalls& calls, Arguments) {
    EXPECT_FALSE(Spawn(calls, "ball", kAda));
    said = calls.error();
    return true;
  });
  Load();
  Run();
  EXPECT_EQ(said, "spawn: `options.predicted` must be the player whose command on_command has got");
}

}  // namespace
}  // namespace tessera::game
