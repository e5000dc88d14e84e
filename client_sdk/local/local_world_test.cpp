// A world in this process, through the interface that games have.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/include/tessera/local.hpp"
#include "game_sdk/examples/car/car_movement.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kScene[] = R"({
  "name": "box",
  "bounds": {"min": {"x": -20, "y": -5, "z": -20}, "max": {"x": 20, "y": 20, "z": 20}},
  "tickRateHz": 60,
  "bodies": [
    {"id": 1, "motion": "MOTION_STATIC", "shape": {"plane": {"normal": {"y": 1}}}},
    {"id": 2, "name": "ball", "mass": 1, "shape": {"sphere": {"radius": 0.5}}, "pose": {"position": {"x": 5, "y": 5}}}
  ],
  "player": {"body": {"mass": 80, "shape": {"sphere": {"radius": 0.5}}}, "spawnPoints": [{"y": 0.5}],
             "maxForce": 800, "maxSpeed": 5}
})";

// The example's field and its car.
std::string CarScene() {
  std::ifstream file(TESSERA_SOURCE_DIR "/game_sdk/examples/car/scene.textproto");
  std::ostringstream text;
  text << file.rdbuf();
  return std::move(text).str();
}

// Played in virtual time: what is waited for are datagrams of this machine, never a clock.
struct LocalWorldTest : testing::Test {
  void Open(const std::string& game = "") {
    const Error error = world.Open({kScene, game});
    ASSERT_FALSE(error) << error.text;
    const Error joined = client.JoinLocal(world);
    ASSERT_FALSE(joined) << joined.text;
  }
  // Frames of a sixtieth of a second until it holds; a failure takes ten seconds of real time.
  template <class Holds>
  testing::AssertionResult Until(Holds holds) {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (!holds()) {
      if (std::chrono::steady_clock::now() > limit) return testing::AssertionFailure() << "never, to " << world.Tick();
      now_ns += 1'000'000'000 / 60;
      const Error advanced = world.Advance(now_ns);
      if (advanced) return testing::AssertionFailure() << advanced.text;
      if (const Error polled = client.Poll(now_ns)) return testing::AssertionFailure() << polled.text;
    }
    return testing::AssertionSuccess();
  }
  const Body* Find(std::uint64_t id) {
    bodies = client.Bodies(now_ns);
    for (const Body& body : bodies) {
      if (body.id == id) return &body;
    }
    return nullptr;
  }

  LocalWorld world;
  Client client;
  std::vector<Body> bodies;
  std::int64_t now_ns = std::int64_t{3600} * 1'000'000'000;
};

TEST_F(LocalWorldTest, AClientJoinsSeesTheWorldMoveAndWalksInIt) {
  ASSERT_NO_FATAL_FAILURE(Open());
  ASSERT_TRUE(Until([&] { return client.state() == TESSERA_PLAYING && Find(2) != nullptr; }));
  EXPECT_TRUE(Until([&] { return Find(2) != nullptr && Find(2)->position[1] < 1; })) << "the ball falls";
  EXPECT_GT(world.Tick(), 30u);
  EXPECT_TRUE(Until([&] {
    client.Move({800, 0, 0});
    const Body* self = Find(client.own_body());
    return self != nullptr && self->position[0] > 2;
  }));
}

TEST_F(LocalWorldTest, AGameRunsInItAndWhatItPrintsIsRead) {
  ASSERT_NO_FATAL_FAILURE(Open(R"(
function on_tick()
  if world.tick() == 3 then print('three') end
  if world.tick() == 4 then error('four') end
end)"));
  std::vector<std::string> lines;
  ASSERT_TRUE(Until([&] {
    for (std::string& line : world.TakeLines()) lines.push_back(std::move(line));
    return lines.size() >= 2;
  })) << testing::PrintToString(lines);
  EXPECT_EQ(lines[0], "three");
  EXPECT_THAT(lines[1], ::testing::StartsWith("error: game.lua:4: four"));
  EXPECT_THAT(world.TakeLines(), IsEmpty());
}

// Through the interface that games have, in C and in C++.
TEST_F(LocalWorldTest, WhatIsThrownIsDrawnAtOnceAndBecomesTheGames) {
  std::string scene = kScene;
  scene.insert(scene.rfind('}'), R"(, "prefabs": [{"name": "ball", "bodies": [
      {"mass": 1, "shape": {"sphere": {"radius": 0.2}}}]}])");
  ASSERT_FALSE(world.Open({scene, R"(
function on_command(player, command)
  if command == 'nothing' then return end
  world.spawn('ball', player:body():position() + vec(0, 1.5, 0), { velocity = vec(0, 3, -6), predicted = player })
end)"}));
  GrantOptions options;
  options.predict = true;
  ASSERT_FALSE(client.JoinLocal(world, options));
  Spawn ball = TESSERA_SPAWN;
  ball.prefab = "ball";
  ball.flags = TESSERA_SPAWN_FROM_OWN;
  ball.position[1] = 1.5;
  ball.velocity[1] = 3;
  ball.velocity[2] = -6;
  std::uint64_t shown = 0;
  ASSERT_TRUE(Until([&] {
    client.Move({50, 0, 0});
    (void)client.Bodies(now_ns);
    return client.GetStats().predicting != 0 && !client.PredictSpawn(ball, "throw", shown);
  }));
  ASSERT_NE(Find(shown), nullptr);
  EXPECT_TRUE((Find(shown)->flags & TESSERA_BODY_PREDICTED) != 0);
  EXPECT_EQ(Find(shown)->region, 0u);
  ASSERT_TRUE(client.InfoOf(shown).has_value()) << "what it looks like is known";
  std::uint64_t taken = 0;
  ASSERT_TRUE(Until([&] {
    (void)client.Bodies(now_ns);
    for (const Event& event : client.TakeEvents()) {
      if (event.kind == TESSERA_EVENT_SPAWN_TAKEN && event.other == shown) taken = event.body;
    }
    return taken != 0;
  }));
  EXPECT_EQ(Find(shown), nullptr);
  ASSERT_NE(Find(taken), nullptr);
  EXPECT_EQ(Find(taken)->region, 1u);
  const std::string wasted = "nothing";
  ASSERT_EQ(tessera_predict_spawn(client.get(), &ball, wasted.data(), wasted.size(), &shown), TESSERA_OK)
      << tessera_last_error();
  bool lost = false;
  EXPECT_TRUE(Until([&] {
    (void)client.Bodies(now_ns);
    for (const Event& event : client.TakeEvents()) {
      lost = lost || (event.kind == TESSERA_EVENT_SPAWN_LOST && event.body == shown);
    }
    return lost;
  }));
  ball.prefab = "bell";
  EXPECT_EQ(tessera_predict_spawn(client.get(), &ball, "x", 1, nullptr), TESSERA_NOT_FOUND);
  EXPECT_STREQ(tessera_last_error(), "prefab: the scene has no \"bell\"");
}

TEST_F(LocalWorldTest, AClockThatStoodAndJumpsMakesNoRace) {
  ASSERT_NO_FATAL_FAILURE(Open());
  ASSERT_TRUE(Until([&] { return world.Tick() > 20; }));
  const std::uint64_t before = world.Tick();
  now_ns += std::int64_t{3600} * 1'000'000'000;
  ASSERT_FALSE(world.Advance(now_ns));
  EXPECT_GT(world.Tick(), before);
  EXPECT_LT(world.Tick(), before + 6);
  const std::uint64_t after = world.Tick();
  ASSERT_FALSE(world.Advance(now_ns - 1'000'000'000)) << "a clock that went back is where it was";
  EXPECT_EQ(world.Tick(), after);
}

TEST_F(LocalWorldTest, TwoWorldsAndTwoPlayersKnowNothingOfEachOther) {
  ASSERT_NO_FATAL_FAILURE(Open());
  LocalWorld other;
  ASSERT_FALSE(other.Open({kScene}));
  Client second, elsewhere;
  ASSERT_FALSE(second.JoinLocal(world));
  ASSERT_FALSE(elsewhere.JoinLocal(other));
  ASSERT_TRUE(Until([&] {
    EXPECT_FALSE(other.Advance(now_ns));
    EXPECT_FALSE(second.Poll(now_ns));
    EXPECT_FALSE(elsewhere.Poll(now_ns));
    return second.Bodies(now_ns).size() == 3 && client.Bodies(now_ns).size() == 3 &&
           elsewhere.Bodies(now_ns).size() == 2;
  }));
  EXPECT_NE(client.own_body(), second.own_body());
  EXPECT_EQ(client.own_body(), elsewhere.own_body()) << "the first player of its world";
}

TEST_F(LocalWorldTest, ClientsOfAWorldThatIsClosedEnd) {
  ASSERT_NO_FATAL_FAILURE(Open());
  ASSERT_TRUE(Until([&] { return client.state() == TESSERA_PLAYING; }));
  world.Close();
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (client.state() != TESSERA_ENDED && std::chrono::steady_clock::now() < limit) {
    now_ns += 1'000'000;
    (void)client.Poll(now_ns);
  }
  EXPECT_EQ(client.state(), TESSERA_ENDED);
}

// One registration: the world's is the client's, whose prediction needs no correction.
TEST(LocalWorldMovementTest, AClientThatJoinsPredictsByTheWorldsMovement) {
  for (const char* game : {"", "function on_tick() end"}) {
    LocalWorld world;
    LocalOptions options{CarScene(), game};
    options.movement = &car_movement;
    const Error opened = world.Open(options);
    ASSERT_FALSE(opened) << opened.text;
    Client client;
    ASSERT_FALSE(client.JoinLocal(world));
    std::int64_t now_ns = std::int64_t{3600} * 1'000'000'000;
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    bool missing = false;
    double driven = 0;
    while (driven < 10 && std::chrono::steady_clock::now() < limit) {
      now_ns += 1'000'000'000 / 60;
      ASSERT_FALSE(world.Advance(now_ns));
      tessera_steering steering = TESSERA_STEERING;
      steering.move[1] = 1;
      tessera_steer(client.get(), &steering);
      ASSERT_FALSE(client.Poll(now_ns));
      for (const Event& event : client.TakeEvents()) missing |= event.kind == TESSERA_EVENT_MOVEMENT_MISSING;
      for (const Body& body : client.Bodies(now_ns)) {
        if (body.id == client.own_body()) driven = -static_cast<double>(body.position[2]);
      }
    }
    EXPECT_GE(driven, 10);
    EXPECT_FALSE(missing);
    EXPECT_NE(client.GetStats().predicting, 0U);
    EXPECT_EQ(world.TakeLines(), std::vector<std::string>());
  }
}

TEST(LocalWorldMovementTest, ABadMovementIsRefusedInOneLine) {
  const auto refusal = [](const tessera_movement& movement, const std::string& scene = CarScene()) {
    LocalWorld world;
    LocalOptions options{scene};
    options.movement = &movement;
    return world.Open(options).text;
  };
  tessera_movement bad = car_movement;
  bad.abi = 8;
  EXPECT_EQ(refusal(bad), "movement: is made for version 8 of the interface, and this is version 1");
  bad = car_movement;
  bad.move = nullptr;
  EXPECT_EQ(refusal(bad), "movement car: move: is missing");
  bad = car_movement;
  bad.kind = "boat";
  EXPECT_EQ(refusal(bad), "movement car: kind: the scene has no kind \"boat\"");
  EXPECT_EQ(refusal(car_movement, R"({"name": "x", "bounds": {"max": {"x": 9, "y": 9, "z": 9}},
      "bodies": [{"id": 2, "mass": 1, "shape": {"sphere": {"radius": 0.5}},
                  "pose": {"position": {"x": 5, "y": 5, "z": 5}}}]})"),
            "movement car: the scene has no player");
}

TEST_F(LocalWorldTest, WhatIsWrongWithSceneAndGameIsNamed) {
  EXPECT_EQ(world.Open({""}).text, "scene: is empty");
  EXPECT_THAT(world.Open({"{\n \"nam\": 1}", "", "a.json"}).text, HasSubstr("a.json:2:2: nam: "));
  EXPECT_THAT(world.Open({kScene, "x = ", "scene", "a.lua"}).text, HasSubstr("a.lua:1:"));
  EXPECT_EQ(world.Open({kScene, "", "scene", "game.lua", 61}).text, "snapshot_rate_hz: must be at most 60, got 61");
  EXPECT_EQ(world.get(), nullptr);
  const std::string nobody = R"({"name": "x", "bounds": {"max": {"x": 9, "y": 9, "z": 9}},
      "bodies": [{"id": 2, "mass": 1, "shape": {"sphere": {"radius": 0.5}},
                  "pose": {"position": {"x": 5, "y": 5, "z": 5}}}]})";
  ASSERT_FALSE(world.Open({nobody}));
  EXPECT_EQ(client.JoinLocal(world).text, "the scene has no player");
}

TEST_F(LocalWorldTest, ArgumentsThatMakeNoSenseAreNamed) {
  tessera_local* made = nullptr;
  const auto refused = [](tessera_code code) {
    EXPECT_EQ(code, TESSERA_INVALID_ARGUMENT);
    return std::string(tessera_last_error());
  };
  tessera_local_options options = TESSERA_LOCAL_OPTIONS;
  EXPECT_EQ(refused(tessera_local_world(nullptr, &made)), "options: is NULL");
  EXPECT_EQ(refused(tessera_local_world(&options, nullptr)), "world: is NULL");
  EXPECT_EQ(refused(tessera_local_world(&options, &made)), "options.scene: is NULL");
  options.scene = kScene;
  options.scene_size = sizeof kScene - 1;
  options.game_size = 1;
  EXPECT_EQ(refused(tessera_local_world(&options, &made)), "options.game: is NULL");
  options.size = 8;
  EXPECT_THAT(refused(tessera_local_world(&options, &made)), HasSubstr("options.size: has 8 bytes"));
  EXPECT_EQ(refused(tessera_local_advance(nullptr, 0)), "world: is NULL");
  EXPECT_EQ(tessera_local_tick(nullptr), 0u);
  EXPECT_EQ(tessera_local_line(nullptr), nullptr);
  tessera_local_close(nullptr);
  EXPECT_EQ(made, nullptr);
}

}  // namespace
}  // namespace tessera
