#include "core/game/effect.h"

#include <gmock/gmock.h>

#include <set>
#include <string>

#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "core/game/testing/scripted_game.h"
#include "game_sdk/api/api.h"

namespace tessera::game::effects {
namespace {

// A function that returns nothing, or changes what another callback sees, has an effect; a new one may not be
// forgotten.
TEST(EffectTest, EachFunctionThatGivesNothingHasOne) {
  std::set<Effect> seen;
  for (const Function& function : Functions()) {
    const auto effect = EffectOf(function.number);
    if (effect) seen.insert(*effect);
    const bool counts_or_logs = function.number == kWorldLog || function.number == kWorldCount;
    if (function.result == kNothingType || function.result == 0) {
      EXPECT_NE(effect.has_value(), counts_or_logs) << function.name;
    }
  }
  EXPECT_EQ(seen.size(), kEffects) << "a kind that no function has";
  EXPECT_FALSE(EffectOf(kBodyPosition) || EffectOf(kWorldRay) || EffectOf(kPlayerName));
}

TEST(EffectTest, AreCountedAsDoneDiscardedOrRefused) {
  FakeGameWorld world;
  world.Add(1, 1);
  world.Add(2, 1);
  ScriptedGame game;
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, ScriptedGame::Arguments arguments) {
    const BodyId self(arguments[0].as.id);
    EXPECT_TRUE(calls.Call(kBodySet, {self, std::string("health"), std::int64_t{5}}));
    EXPECT_TRUE(calls.Call(kBodyWake, {self}));
    EXPECT_FALSE(calls.Call(kBodyImpulse, {self, std::string("up")}));
    EXPECT_TRUE(calls.Call(kBodyMass, {self}));
    return self == BodyId(1);
  });
  const tessera_game_module module = game.module();
  const auto host = GameHost::Load(module, {"game.lua", "fine"}, world.shared_scene());
  ASSERT_TRUE(host.ok()) << host.status();
  const std::vector<GameEvent> touches{{kOnBodyContact, BodyId(1), BodyId(2)}, {kOnBodyContact, BodyId(2), BodyId(1)}};
  (*host)->Run(Tick(1), touches, world);
  const EffectCounts& counts = (*host)->statistics().effects;
  EXPECT_EQ(counts[static_cast<std::size_t>(Effect::kProperty)], (EffectCount{1, 1, 0}));
  EXPECT_EQ(counts[static_cast<std::size_t>(Effect::kMotion)], (EffectCount{1, 1, 2}));
  EXPECT_EQ(counts[static_cast<std::size_t>(Effect::kSpawn)], EffectCount());
}

}  // namespace
}  // namespace tessera::game::effects
