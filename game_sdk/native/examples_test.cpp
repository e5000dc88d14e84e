// The example games: the same game in Lua and in C++ gives the same bits.
#include <gmock/gmock.h>

#include <fstream>
#include <iterator>

#include "core/region/region.h"
#include "core/world/scene_io.h"
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

TEST(ExampleGamesTest, TheCarDrivesInItsScene) {
  std::ifstream file(TESSERA_SOURCE_DIR "/game_sdk/examples/car/scene.textproto");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto written = ParseScene(text, "scene.textproto");
  ASSERT_TRUE(written.ok()) << written.status();
  const auto scene = ResolveScene(*written, "scene.textproto");
  ASSERT_TRUE(scene.ok()) << scene.status();
  const auto car = NativeModule::Load(TESSERA_BINARY_DIR "/game_modules", "car");
  ASSERT_TRUE(car.ok()) << car.status();
  auto host = GameHost::Load((*car)->module(), {"car", ""}, *scene);
  ASSERT_TRUE(host.ok()) << host.status();

  constexpr PlayerNumber kDriver{1};
  region::Config config{RegionId(1), Incarnation(1), *scene, *MakeGridMap((*scene)->ground(), 1), {}, nullptr};
  config.game = *std::move(host);
  region::Region region(std::move(config));
  region.Start();
  region.SpawnPlayer(kDriver);
  for (std::uint32_t tick = 1; tick <= 600; ++tick) {
    region.Step();
    PlayerInput input;
    input.number = tick;
    input.player = kDriver;
    input.body = PlayerBodyId(kDriver);
    input.move = {0, tick > 120 ? 0.5F : 0.0F};
    ASSERT_TRUE(region.QueueInput(input).ok()) << tick;
    for (const GameLine& line : region.game()->TakeLines()) EXPECT_FALSE(line.error) << line.text;
  }
  const BodyState state = region.world().StateOf(PlayerBodyId(kDriver));
  EXPECT_LT(state.position.z, -60) << "it has passed the ramp";
  EXPECT_GT(Rotate(state.orientation, Vec3d(0, 1, 0)).y, 0.8) << "on its wheels";
}

}  // namespace
}  // namespace tessera::game
