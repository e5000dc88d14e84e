// A game makes bodies in a region with a wall, which the physics knows.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/region.h"
#include "core/region/testing/small_world.h"
#include "game_sdk/api/api.h"

namespace tessera::region::spawning {
namespace {

using game::GameCalls;
using Arguments = game::ScriptedGame::Arguments;

// A wall from x = 5 to 7, a trigger about it, and prefabs: a ball, and two balls 2 m apart.
std::shared_ptr<const Scene> WalledScene() {
  Scene scene = Balls({{-5, 0, 0}, {6, 0, 0}, {6, 0, 0}});
  scene.kinds = {""};
  BodyDef& wall = scene.bodies[1];
  wall.name = "wall";
  wall.motion = Motion::kStatic;
  wall.shape = std::make_shared<const Shape>(Shape{BoxShape{{1, 2, 2}}});
  BodyDef& zone = scene.bodies[2];
  zone.motion = Motion::kStatic;
  zone.trigger = true;
  zone.shape = std::make_shared<const Shape>(Shape{BoxShape{{3, 3, 3}}});
  for (const std::uint64_t bodies : {1, 2}) {
    Prefab& prefab = scene.prefabs.emplace_back();
    prefab.name = bodies == 1 ? "single" : "pair";
    for (std::uint64_t i = 0; i < bodies; ++i) {
      BodyDef& def = prefab.bodies.emplace_back(scene.bodies[0]);
      def.id = BodyId(i + 1);
      def.initial = {};
      def.initial.position = {2 * static_cast<double>(i), 0, 0};
    }
  }
  return std::make_shared<const Scene>(std::move(scene));
}

TEST(RegionSpawnPlaceTest, NothingIsMadeInsideAWall) {
  const std::shared_ptr<const Scene> scene = WalledScene();
  game::ScriptedGame game;
  const auto spawn = [](GameCalls& calls, const char* prefab, Vec3d at) {
    return calls.Call(game::kWorldSpawn, {std::string(prefab), at});
  };
  int calls_made = 0;
  game.On(game::kOnTick, "", [&](GameCalls& calls, Arguments) {
    if (++calls_made > 1) return true;
    EXPECT_FALSE(spawn(calls, "single", {5.9, 0, 0}));
    EXPECT_EQ(calls.error(), "spawn: \"single\" would be inside static body 2 \"wall\"");
    EXPECT_FALSE(spawn(calls, "pair", {4.5, 0, 0}));
    EXPECT_EQ(calls.error(), "spawn: body 2 of \"pair\" would be inside static body 2 \"wall\"");
    EXPECT_TRUE(spawn(calls, "single", {4.9, 0, 0})) << "it may stick in a wall by a part, and be in a trigger";
    EXPECT_TRUE(spawn(calls, "single", {-5, 0, 0})) << "and in what moves: they push each other out";
    return true;
  });
  const tessera_game_module module = game.module();
  Config config{kOne, Incarnation(1), scene, *MakeGridMap(scene->ground(), 1), {}};
  config.game = *game::GameHost::Load(module, {"game.lua", "fine"}, scene);
  Region region(std::move(config));
  region.Start();
  region.Step();
  EXPECT_EQ(region.owned().size(), 3U);
  region.Step();
  EXPECT_EQ(region.owned().size(), 3U);
}

}  // namespace
}  // namespace tessera::region::spawning
