// Tests that are written in Lua: what they can do, and what their failures say.
#include "game_sdk/testing/game_tests.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "core/world/scene_load.h"
#include "game_sdk/api/api.h"
#include "game_sdk/examples/car/car_movement.h"
#include "game_sdk/lua/lua_module.h"
#include "game_sdk/tools/new_game.h"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::string FileOf(const std::vector<GameFile>& files, const std::string& name) {
  for (const GameFile& file : files) {
    if (file.name == name) return file.bytes;
  }
  ADD_FAILURE() << name;
  return "";
}

class GameTestsTest : public ::testing::Test {
 protected:
  // The world of a new game, with a game and tests of its own.
  void Run(const std::string& game, const std::string& tests, const GameTestOptions& options = {}) {
    const std::vector<GameFile> files = NewGame("test");
    const auto scene = LoadScene(SceneForm::kText, FileOf(files, "scene.json"), "scene.json");
    ASSERT_TRUE(scene.ok()) << scene.status();
    results.clear();
    const GameUnderTest tested{
        *LuaGameModule(), {"game.lua", game.empty() ? FileOf(files, "game.lua") : game}, scene->scene};
    const GameFile script{"game_test.lua", tests.empty() ? FileOf(files, "game_test.lua") : tests};
    failed = RunGameTests(tested, script, options, [&](const GameTestResult& result) { results.push_back(result); });
  }
  // The text of the only failure of a test with these statements.
  std::string FailureOf(const std::string& statements, const std::string& game = "") {
    Run(game, "test('x', function(t)\n" + statements + "\nend)");
    EXPECT_TRUE(failed.ok()) << failed.status();
    if (results.size() != 1 || results[0].failures.size() > 1) ADD_FAILURE() << statements;
    return results.empty() || results[0].failures.empty() ? "" : results[0].failures[0].text;
  }
  std::string Refusal(const std::string& tests, const std::string& game = "") {
    Run(game, tests);
    return std::string(failed.status().message());
  }

  absl::StatusOr<std::size_t> failed;
  std::vector<GameTestResult> results;
};

TEST_F(GameTestsTest, ANewGamePassesItsTests) {
  Run("", "");
  ASSERT_TRUE(failed.ok()) << failed.status();
  for (const GameTestResult& result : results) {
    for (const GameTestFailure& failure : result.failures) {
      ADD_FAILURE() << result.name << ": " << failure.text << " (" << failure.conditions.front() << ")";
    }
  }
  EXPECT_EQ(*failed, 0U);
  ASSERT_THAT(results, SizeIs(3));
  EXPECT_GT(results[0].handovers, 0U);
  EXPECT_GT(results[2].deaths, 2U);
}

// In one region and in four, with fresh states and deaths.
TEST_F(GameTestsTest, PlayersJoinCommandHearAndAreSentAway) {
  Run(R"(
        function on_join(player)
          if player:name() == "mallory" then player:refuse("not you") end
          if player:name() == "ada" then player:place(vec(3, 2, 3)) end
        end
        function on_leave(player) world.log("bye " .. player:name()) end
        function on_command(player, bytes)
          if bytes == "die" then player:spectate(vec(-3, 8, -3)) end
          if bytes == "live" then player:respawn(vec(2, 2, 2)) end
          if bytes == "quit" then return player:kick("as you like") end
          player:send("done", { what = bytes, number = 7 })
        end
      )",
      R"(
        test("ada plays", function(t)
          local ada, mallory = t:join("ada"), t:join("mallory")
          t:step(1)
          t:expect_near(ada:position(), vec(3, 2, 3), 0.2)
          t:step_until(10, function() return t:ended(mallory) end)
          t:expect_equal(t:ended(mallory), "not you")
          t:command(ada, "die")
          t:step(4)
          t:expect(ada:player():is_spectating())
          t:expect_near(ada:position(), vec(-3, 8, -3), 0.01)
          t:command(ada, "live")
          t:step(1)
          t:expect_near(ada:position(), vec(2, 2, 2), 0.2)
          t:kill_region_of(ada)
          for i = 1, 30 do
            t:command(ada, "x" .. i)
            t:step()
          end
          t:step(10)
          local events = t:events(ada)
          t:expect_equal(#events, 32)
          t:expect_equal(events[1].name, "done")
          t:expect_equal(events[1].values.what, "die")
          t:expect_equal(events[1].values.number, 7)
          for i = 1, 30 do t:expect_equal(events[i + 2].values.what, "x" .. i) end
          t:expect_equal(#t:events(ada), 0)
          t:command(ada, "quit")
          t:step_until(10, function() return t:ended(ada) end)
          t:step(3)
          t:expect_equal(t:lines()[1], "bye ada")
          t:expect_equal(#t:lines(), 1)
        end)
      )");
  ASSERT_TRUE(failed.ok()) << failed.status();
  for (const GameTestFailure& failure : results.at(0).failures) {
    ADD_FAILURE() << failure.text << " (" << failure.conditions.front() << ")";
  }
}

TEST_F(GameTestsTest, WhatATestAsksOfAPlayerWronglyIsNamed) {
  EXPECT_THAT(FailureOf("t:join('a\\nb')"), HasSubstr("player_name: has a control character"));
  EXPECT_THAT(FailureOf("t:command(t:body('ball'), 'x')"), HasSubstr("command: body 3 is no player's"));
  EXPECT_THAT(FailureOf("local p = t:join()\nt:command(p, string.rep('x', 2048))"),
              HasSubstr("bytes: 2048 are more than 1024"));
}

TEST_F(GameTestsTest, AFailureNamesPlaceValuesAndConditions) {
  EXPECT_EQ(FailureOf("local ball = t:body('ball')\nt:step(2)\nt:expect_equal(ball.score, 1)"),
            "game_test.lua:4: got 0, expected 1");
  EXPECT_THAT(results[0].failures[0].conditions,
              ElementsAre("1 region", "4 regions", "4 regions, fresh states", "4 regions, deaths"));
  EXPECT_EQ(*failed, 1U);
  EXPECT_EQ(FailureOf("t:expect_equal(1, 2, 'the score')"), "game_test.lua:2: the score: got 1, expected 2");
  EXPECT_EQ(FailureOf("t:expect(false)"), "game_test.lua:2: expected something true, got false");
  EXPECT_EQ(FailureOf("t:expect(nil, 'no ball')"), "game_test.lua:2: no ball");
  EXPECT_EQ(FailureOf("t:expect_near(1, 1.5, 0.25)"), "game_test.lua:2: got 1, expected 1.5 +- 0.25");
  EXPECT_EQ(FailureOf("t:expect_near(vec(0, 0, 0), vec(0, 0.5, 0), 0.25)"),
            "game_test.lua:2: got (0, 0, 0), expected (0, 0.5, 0) +- 0.25");
  EXPECT_EQ(FailureOf("t:expect_near(-(0/0), 1, 1)"), "game_test.lua:2: got nan, expected 1 +- 1");
  EXPECT_EQ(FailureOf("t:step_until(3, function() return false end)"),
            "game_test.lua:2: step_until: not within 3 ticks");
  EXPECT_EQ(FailureOf("t:expect_near(vec(1, 0, 0), vec(1, 0.1, 0), 0.2) t:expect_equal(vec(1, 2, 3), vec(1, 2, 3))"),
            "");
}

TEST_F(GameTestsTest, WrongUseIsSaidByName) {
  EXPECT_EQ(FailureOf("t:body('bal')"), "game_test.lua:2: the scene has no body \"bal\"; did you mean \"ball\"?");
  EXPECT_EQ(FailureOf("t:body(77)"), "game_test.lua:2: body: there is no body 77");
  EXPECT_EQ(FailureOf("t:bodies('gat')"), "game_test.lua:2: the scene has no kind \"gat\"; did you mean \"gate\"?");
  EXPECT_EQ(FailureOf("t.step(1)"), "game_test.lua:2: call it as t:name(...), with a colon");
  EXPECT_EQ(FailureOf("t:step(0)"), "game_test.lua:2: step: takes 1 to 1 000 000 ticks");
  EXPECT_THAT(FailureOf("t:body('ball').scroe = 1"), HasSubstr("game_test.lua:2: "));
  EXPECT_THAT(FailureOf("t:place(t:body('ball'), { pos = vec(0, 0, 0) })"), HasSubstr("got `pos`"));
  EXPECT_EQ(FailureOf("t:place(t:body('ball'), { position = 3 })"),
            "game_test.lua:2: place: `position` must be a vector, got a whole number");
  EXPECT_EQ(FailureOf("t:kill_region_of(t:body('ground'))"), "game_test.lua:2: kill_region_of: no region owns body 1");
  EXPECT_EQ(FailureOf("while true do end"), "game_test.lua:2: too much work");
}

TEST_F(GameTestsTest, AnErrorOfTheGameFailsTheTestUnlessItIsAllowed) {
  const std::string game = "kinds.ball = { on_tick = function(self) error('oops') end }";
  EXPECT_EQ(FailureOf("t:step()", game), "game_test.lua:2: tick 1, body 3: game.lua:1: oops");
  EXPECT_EQ(FailureOf("t:allow_errors() t:step(2) t:expect_equal(#t:errors(), 2)", game), "");
}

TEST_F(GameTestsTest, ATestActsOnTheWorldAsGameCodeDoes) {
  EXPECT_EQ(FailureOf("local ball = t:body('ball')\n"
                      "ball.score = 7\n"
                      "t:expect_equal(ball.score, 7)\n"
                      "ball:set_velocity(vec(0, 5, 0))\n"
                      "t:step(2)\n"
                      "t:expect_equal(ball.score, 7)\n"
                      "t:expect(ball:velocity().y > 4)\n"
                      "t:expect_equal(ball:kind(), 'ball')\n"
                      "t:expect(world.tick() >= 2)\n"
                      "t:expect_equal(#t:bodies(), 3) t:expect_equal(t:bodies('ball')[1], ball)"),
            "");
}

TEST_F(GameTestsTest, PlayersJoinMoveAndLeave) {
  EXPECT_EQ(FailureOf("local player = t:join()\n"
                      "t:step()\n"
                      "local from = player:position()\n"
                      "for i = 1, 60 do t:input(player, vec(400, 0, 0)) t:step() end\n"
                      "t:expect(player:position().x > from.x + 1)\n"
                      "t:leave(player)\n"
                      "t:step(2)\n"
                      "t:expect(not player:is_here())"),
            "");
}

TEST_F(GameTestsTest, WhatTheScriptPrintsAndTheGameLogsAreKeptApart) {
  Run("function on_tick() print('tick', world.tick()) end",
      "test('x', function(t) print('hello', 1) t:step(2) t:expect(t:lines()[1], 'no line') end)");
  ASSERT_TRUE(failed.ok()) << failed.status();
  EXPECT_THAT(results[0].failures, IsEmpty());
  EXPECT_THAT(results[0].output, ElementsAre("hello\t1"));
}

TEST_F(GameTestsTest, EachTestBeginsAnew) {
  Run("",
      "local n = 0\nlocal function count(t) n = n + 1 t:expect_equal(n, 1) t:expect_equal(t:tick(), 0) t:step() end\n"
      "test('a', count) test('b', count)");
  ASSERT_TRUE(failed.ok()) << failed.status();
  EXPECT_EQ(*failed, 0U);
}

TEST_F(GameTestsTest, ScriptsAndGamesThatCannotBeLoadedAreRefused) {
  EXPECT_EQ(Refusal("local x = = 1"), "game_test.lua:1: unexpected symbol near '='");
  EXPECT_EQ(Refusal("local x = 1"), "game_test.lua: calls `test` nowhere");
  EXPECT_THAT(Refusal("test('a', function() end) test('a', function() end)"), HasSubstr("two called \"a\""));
  EXPECT_THAT(Refusal("io.open('x')"), HasSubstr("`io` is not defined"));
  EXPECT_THAT(Refusal("test('a', function() end)", "local n = 0 function on_tick() n = 1 end"),
              HasSubstr("game.lua:1: `n` would be kept"));
}

// Sixty balls that a vortex drives through all borders and into each other.
std::shared_ptr<const Scene> Vortex() {
  auto scene = std::make_shared<Scene>();
  scene->bounds = {{-20, -20, -20}, {20, 20, 20}};
  scene->kinds = {"", "ball"};
  scene->properties = {{"hits", std::int64_t{0}}, {"waiting", std::int64_t{0}}};
  scene->fields.push_back(VortexField{{0, 0, 0}, 30, 0.8, 4});
  for (std::uint64_t id = 1; id <= 61; ++id) {
    BodyDef def;
    def.id = BodyId(id);
    if (id == 61) {
      def.shape = std::make_shared<const Shape>(Shape{PlaneShape{}});
      def.motion = Motion::kStatic;
      def.mass_kg = 0;
    } else {
      def.kind = 1;
      def.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
      def.initial.position = {-14 + 4.0 * static_cast<double>(id % 8), 0.6, -14 + 4.0 * static_cast<double>(id / 8)};
      def.initial.linear_velocity = {static_cast<float>(id * 7 % 17) - 8, 0, static_cast<float>(id * 5 % 13) - 6};
      def.material = {0, 0, 0, 1};  // neither friction nor loss
    }
    scene->bodies.push_back(std::move(def));
  }
  return scene;
}

TEST_F(GameTestsTest, TimersAreNeitherLostNorDoubledInACrowd) {
  const GameFile game{"game.lua", R"(
    kinds.ball = {
      on_contact = function(self, other)
        self.hits = self.hits + 1
        if world.tick() > 200 or self.waiting >= 16 then return end
        self:after(math.random(60), "late", { by = other })
        self.waiting = self.waiting + 1
      end,
      on_timer = function(self) self.waiting = self.waiting - 1 end,
    })"};
  const GameFile script{"game_test.lua", R"(
    test("crowd", function(t)
      t:step(280)
      local hits = 0
      for _, ball in ipairs(t:bodies("ball")) do
        hits = hits + ball.hits
        t:expect_equal(ball.waiting, 0)
      end
      t:expect(hits > 100, "hits: " .. hits)
    end))"};
  failed = RunGameTests({*LuaGameModule(), game, Vortex()}, script, {},
                        [&](const GameTestResult& result) { results.push_back(result); });
  ASSERT_TRUE(failed.ok()) << failed.status();
  for (const GameTestFailure& failure : results[0].failures) ADD_FAILURE() << failure.text;
  EXPECT_GT(results[0].handovers, 50U);
  EXPECT_GT(results[0].deaths, 2U);
}

// A module that counts in its own memory, as no game may.
TEST_F(GameTestsTest, AGameThatFreshStatesChangeFails) {
  using Counter = std::pair<const tessera_game_host*, std::int64_t>;
  static constexpr tessera_game_module kCounting = {
      sizeof kCounting,
      TESSERA_GAME_ABI,
      [](const tessera_game_host* host, const tessera_game_source*, void** game, tessera_game_error*) {
        *game = new Counter(host, 0);
        return 0;
      },
      [](void* game) { delete static_cast<Counter*>(game); },
      [](const void*, std::uint32_t callback, const char* kind) {
        return callback == kOnBodyTick && std::string_view(kind) == "ball" ? 1 : 0;
      },
      [](void* game, tessera_game_call* call, const tessera_game_callback* event, tessera_game_error*) {
        auto& [host, number] = *static_cast<Counter*>(game);
        tessera_game_value arguments[3] = {event->arguments[0], {}, {}}, result{};
        arguments[1].type = TESSERA_GAME_TEXT;
        arguments[1].count = 5;
        arguments[1].as.text = "score";
        arguments[2].type = TESSERA_GAME_WHOLE;
        arguments[2].as.whole = ++number;
        return host->call(call, kBodySet, arguments, 3, &result);
      },
      nullptr};
  const auto scene = LoadScene(SceneForm::kText, FileOf(NewGame("test"), "scene.json"), "scene.json");
  ASSERT_TRUE(scene.ok()) << scene.status();
  const GameFile script{"game_test.lua", "test('x', function(t) t:step(3) end)"};
  failed = RunGameTests({kCounting, {"game", ""}, scene->scene}, script, {},
                        [&](const GameTestResult& result) { results.push_back(result); });
  ASSERT_TRUE(failed.ok()) << failed.status();
  ASSERT_THAT(results[0].failures, SizeIs(1));
  EXPECT_EQ(
      results[0].failures[0].text,
      "game: fresh Lua states change the game from tick 2 on; at the end body 3: score is 3, with fresh states 1");
  EXPECT_THAT(results[0].failures[0].conditions, ElementsAre("4 regions, fresh states"));
}

// A game in Lua whose players drive: the movement comes beside the file, and goes along with the car from region to
// region and through deaths.
class DrivingTest : public GameTestsTest {
 protected:
  void Drive(const std::string& statements, const tessera_movement* movement) {
    const std::string path = TESSERA_SOURCE_DIR "/game_sdk/examples/car/scene.textproto";
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    const auto scene = LoadScene(SceneForm::kText, text.str(), path);
    ASSERT_TRUE(scene.ok()) << scene.status();
    const GameFile script{"drive_test.lua", "test('it drives', function(t)\n" + statements + "\nend)"};
    const GameFile game{"drive.lua", "function on_tick() end", movement};
    failed = RunGameTests({*LuaGameModule(), game, scene->scene}, script, {},
                          [&](const GameTestResult& result) { results.push_back(result); });
  }
};

constexpr char kThereAndBrake[] = R"(
  local car = t:join()
  t:step(90)
  t:expect_near(car:position().y, 0.9, 0.5, 'it stands on its springs')
  local from = car:position()
  for _ = 1, 240 do
    t:steer(car, { forward = 1, right = 0.3 })
    t:step()
  end
  t:expect((car:position() - from):length() > 10, 'the car has not moved')
  for _ = 1, 300 do
    t:steer(car, { buttons = 1 })
    t:step()
  end
  t:expect(car:velocity():length() < 0.1, 'the car has not stopped'))";

TEST_F(DrivingTest, AGameInLuaHasTheMovementBesideIt) {
  Drive(kThereAndBrake, &car_movement);
  ASSERT_TRUE(failed.ok()) << failed.status();
  ASSERT_THAT(results, SizeIs(1));
  for (const GameTestFailure& failure : results[0].failures) ADD_FAILURE() << failure.text << failure.conditions[0];
  EXPECT_GT(results[0].handovers, 0U);
  EXPECT_GT(results[0].deaths, 0U);
}

TEST_F(DrivingTest, WithoutTheMovementNobodyDrives) {
  Drive(kThereAndBrake, nullptr);
  ASSERT_TRUE(failed.ok()) << failed.status();
  std::size_t conditions = 0;
  for (const GameTestFailure& failure : results[0].failures) {
    EXPECT_THAT(failure.text, HasSubstr("it stands on its springs"));
    conditions += failure.conditions.size();
  }
  EXPECT_EQ(conditions, 4U) << "it is so however many regions there are";
}

TEST_F(DrivingTest, AMovementThatFailsFailsTheTest) {
  tessera_movement broken = car_movement;
  broken.move = [](const tessera_movement_tick*, void*, tessera_movement_push*) { return 4; };
  Drive("local car = t:join() t:step(30)", &broken);
  ASSERT_TRUE(failed.ok()) << failed.status();
  ASSERT_THAT(results[0].failures, ::testing::Not(IsEmpty()));
  EXPECT_THAT(results[0].failures[0].text, HasSubstr("player 1 is not moved: movement car: returned 4"));
}

TEST_F(DrivingTest, AMovementThatTheSceneHasNoUseForIsRefused) {
  tessera_movement boat = car_movement;
  boat.kind = "boat";
  Drive("t:step()", &boat);
  EXPECT_EQ(failed.status().message(), "drive.lua: movement car: kind: the scene has no kind \"boat\"");
}

TEST_F(DrivingTest, SteeringThatCannotBeIsNamed) {
  const auto why = [this](const std::string& steering) {
    results.clear();
    Drive("local car = t:join() t:step(2) t:steer(car, " + steering + ")", &car_movement);
    return results.empty() || results[0].failures.empty() ? "" : results[0].failures[0].text;
  };
  EXPECT_EQ(why("{ right = 3, forward = 4, yaw = 7, pitch = -2, buttons = 5 }"), "") << "as a client would send it";
  EXPECT_THAT(why("{ left = 1 }"),
              HasSubstr("steer: takes right, forward, yaw, pitch (numbers) and buttons (bits), got `left`"));
  EXPECT_THAT(why("{ forward = 0/0 }"), HasSubstr("steer: `forward` must be a finite number, got "));
  EXPECT_THAT(why("{ yaw = '1' }"), HasSubstr("steer: `yaw` must be a finite number, got "));
  EXPECT_THAT(why("{ buttons = -1 }"), HasSubstr("got `buttons`"));
}

TEST_F(GameTestsTest, OneRegionIsEnough) {
  GameTestOptions options;
  options.regions = 1;
  Run("",
      "test('x', function(t) t:step(3) t:expect_equal(t:regions(), 1) t:expect_equal(t:region_of(t:body('ball')), 1)"
      " t:kill_region_of(t:body('ball')) t:step() end)",
      options);
  ASSERT_TRUE(failed.ok()) << failed.status();
  EXPECT_EQ(*failed, 0U);
}

}  // namespace
}  // namespace tessera::game
