// The example games: the same game in Lua and in C++ gives the same bits.
#include <gmock/gmock.h>

#include <fstream>
#include <iterator>

#include "game_sdk/lua/lua_module.h"
#include "game_sdk/native/native_module.h"
#include "game_sdk/testing/lockstep_world.h"

namespace tessera::game {
namespace {

// A floor of 40 by 40 m, on which balls fall.
std::shared_ptr<const Scene> FountainScene() {
  auto scene = std::make_shared<Scene>();
  scene->bounds = {{-20, -20, -20}, {20, 20, 20}};
  scene->kinds = {"", "ball"};
  scene->properties = {{"hits", std::int64_t{0}}};
  BodyDef floor;
  floor.id = BodyId(1);
  floor.motion = Motion::kStatic;
  floor.mass_kg = 0;
  floor.shape = std::make_shared<const Shape>(Shape{BoxShape{{20, 0.5, 20}}});
  floor.initial.position = {0, -0.5, 0};
  scene->bodies.push_back(floor);
  Prefab& prefab = scene->prefabs.emplace_back();
  prefab.name = "ball";
  BodyDef& ball = prefab.bodies.emplace_back();
  ball.id = BodyId(1);
  ball.kind = 1;
  ball.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  ball.material.restitution = 0.5;
  return scene;
}

// The world's hash every 60 ticks.
std::vector<std::uint64_t> HashesOf(const tessera_game_module& module, const GameFile& file,
                                    const LockstepOptions& options) {
  auto world = LockstepWorld::Create(module, file, FountainScene(), options);
  EXPECT_TRUE(world.ok()) << world.status();
  std::vector<std::uint64_t> hashes;
  for (int tick = 1; tick <= 300; ++tick) {
    const absl::Status status = (*world)->Step();
    EXPECT_TRUE(status.ok()) << status;
    if (tick % 60 == 0) hashes.push_back((*world)->Hash());
  }
  for (const GameLine& line : (*world)->TakeLines()) ADD_FAILURE() << line.text;
  EXPECT_GT((*world)->handovers(), 3U);
  return hashes;
}

TEST(ExampleGamesTest, TheSameGameInLuaAndInCppGivesTheSameBits) {
  std::ifstream file(TESSERA_SOURCE_DIR "/game_sdk/examples/fountain/fountain.lua");
  const GameFile lua{"fountain.lua", {std::istreambuf_iterator<char>(file), {}}};
  const auto native = NativeModule::Load(TESSERA_BINARY_DIR "/game_modules", "fountain");
  ASSERT_TRUE(native.ok()) << native.status();
  for (const bool deaths : {false, true}) {
    LockstepOptions options;
    options.deaths = deaths;
    options.fresh_states = deaths;
    const std::vector<std::uint64_t> expected = HashesOf(*LuaGameModule(), lua, options);
    EXPECT_EQ(HashesOf((*native)->module(), {"fountain", ""}, options), expected) << deaths;
    EXPECT_NE(expected.front(), expected.back());
  }
}

}  // namespace
}  // namespace tessera::game
