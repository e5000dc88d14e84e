// Games in requests for instances: loaded once, within bounds, before anything is made.
#include "control_plane/instance_plan.h"

#include <gmock/gmock.h>

#include "core/game/game_file.h"
#include "core/world/scene_io.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

v1::CreateInstanceRequest RequestWithGame(const std::string& content, const std::string& name = "game.lua") {
  v1::CreateInstanceRequest request;
  request.mutable_spec()->set_regions(1);
  *request.mutable_spec()->mutable_scene() = *ParseScene(R"(
      name: "table"
      bounds { min { x: -50 y: -10 z: -50 } max { x: 50 y: 50 z: 50 } }
      bodies { id: 2 mass: 1 kind: "ball" shape { sphere { radius: 0.5 } } pose { position { y: 5 } } })",
                                                         "test");
  request.mutable_spec()->mutable_game()->set_name(name);
  request.mutable_spec()->mutable_game()->set_content(content);
  return request;
}

std::string RefusalOf(const v1::CreateInstanceRequest& request) {
  const auto plan = PlanInstance(request);
  EXPECT_EQ(plan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(plan.status().message(), ::testing::Not(HasSubstr("\n")));
  return std::string(plan.status().message());
}

TEST(InstancePlanTest, AGameIsKeptByItsHash) {
  const std::string game = "kinds.ball = { on_contact = function(self, other) end }";
  const auto plan = PlanInstance(RequestWithGame(game));
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->game_name, "game.lua");
  EXPECT_EQ(plan->game_hash, game::GameHash(game));
  EXPECT_EQ(plan->contents.game, game);
}

TEST(InstancePlanTest, WithoutAGameThereIsNone) {
  v1::CreateInstanceRequest request = RequestWithGame("x = 1");
  request.mutable_spec()->clear_game();
  const auto plan = PlanInstance(request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->game_hash, "");
  EXPECT_EQ(plan->contents.game, "");
}

TEST(InstancePlanTest, ANativeGameIsKnownByItsNameAndHasNoFile) {
  v1::CreateInstanceRequest request = RequestWithGame("x = 1");
  request.mutable_spec()->mutable_native_game()->set_name("arena");
  EXPECT_EQ(RefusalOf(request), "spec.native_game: spec.game is there too, and a world runs one game");
  request.mutable_spec()->clear_game();
  request.mutable_spec()->mutable_native_game()->set_hash(std::string(64, 'a'));
  const auto plan = PlanInstance(request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_TRUE(plan->game_native);
  EXPECT_EQ(plan->game_name, "arena");
  EXPECT_EQ(plan->game_hash, std::string(64, 'a'));
  EXPECT_EQ(plan->contents.game, "");
  request.mutable_spec()->mutable_native_game()->set_hash("feed");
  EXPECT_THAT(RefusalOf(request), StartsWith("spec.native_game.hash: "));
  request.mutable_spec()->mutable_native_game()->set_name("../arena");
  EXPECT_THAT(RefusalOf(request), StartsWith("spec.native_game.name: "));
}

TEST(InstancePlanTest, AMovementStandsBesideAGameInLua) {
  v1::CreateInstanceRequest request = RequestWithGame("x = 1");
  request.mutable_spec()->mutable_movement()->set_name("car");
  request.mutable_spec()->mutable_scene()->clear_player();
  EXPECT_EQ(RefusalOf(request), "spec.movement: the scene has no player");
  v1::PlayerRules& player = *request.mutable_spec()->mutable_scene()->mutable_player();
  player.mutable_body()->set_mass(80);
  player.mutable_body()->mutable_shape()->mutable_sphere()->set_radius(0.5);
  player.add_spawn_points()->set_y(1);
  player.set_max_force(1);
  player.set_max_speed(5);
  const auto plan = PlanInstance(request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  ASSERT_TRUE(plan->movement.has_value());
  EXPECT_EQ(plan->movement->name(), "car");
  EXPECT_FALSE(plan->game_native);
  request.mutable_spec()->mutable_movement()->set_hash("feed");
  EXPECT_THAT(RefusalOf(request), StartsWith("spec.movement.hash: "));
  request.mutable_spec()->mutable_movement()->set_name("../car");
  EXPECT_THAT(RefusalOf(request), StartsWith("spec.movement.name: "));
  request.mutable_spec()->clear_game();
  EXPECT_EQ(RefusalOf(request), "spec.movement: stands beside a game in Lua, and spec.game is missing");
}

TEST(InstancePlanTest, AGameThatDoesNotLoadIsRefusedByFileAndLine) {
  EXPECT_THAT(RefusalOf(RequestWithGame("local n = 1\nfunction on_tick(\n")), StartsWith("game.lua:3: "));
  EXPECT_THAT(RefusalOf(RequestWithGame("\nwhile true do end")), StartsWith("game.lua:2: too much work"));
  EXPECT_THAT(RefusalOf(RequestWithGame("local t = {}\nfor i = 1, 1e9 do t[i] = ('x'):rep(60000) .. i end")),
              StartsWith("game.lua:2: too much memory"));
  EXPECT_THAT(RefusalOf(RequestWithGame("\x1bLuaT")), HasSubstr("binary chunk"));
  EXPECT_THAT(RefusalOf(RequestWithGame("kinds.ball = { on_contcat = function() end }")), HasSubstr("on_contact?"));
}

TEST(InstancePlanTest, SizeAndNameOfAGameAreBoundedBeforeItIsLoaded) {
  EXPECT_EQ(RefusalOf(RequestWithGame(std::string(2 << 20, ' '))),
            "spec.game.content: has 2097152 bytes, more than 1048576");
  EXPECT_EQ(RefusalOf(RequestWithGame("")), "spec.game.content: is empty");
  EXPECT_THAT(RefusalOf(RequestWithGame("x = 1", "game\n.lua")), StartsWith("spec.game.name: "));
}

}  // namespace
}  // namespace tessera::control
