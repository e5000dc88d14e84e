// Games in several regions of one process: handovers, deaths, restarts, and calls of a test.
#include "game_sdk/testing/lockstep_world.h"

#include <gmock/gmock.h>

#include "game_sdk/api/api.h"
#include "game_sdk/lua/lua_module.h"

namespace tessera::game {
namespace {

using ::testing::HasSubstr;

constexpr BodyId kLockstepBall{1}, kLockstepWall{3};

// Two balls of 1 kg without gravity in 40 by 40 m, body 1 flying to the right, and a wall.
std::shared_ptr<const Scene> FlyingBalls() {
  auto scene = std::make_shared<Scene>();
  scene->bounds = {{-20, -20, -20}, {20, 20, 20}};
  scene->gravity_m_s2 = {};
  scene->kinds = {"", "ball"};
  scene->properties = {{"count", std::int64_t{0}}};
  for (std::uint64_t id = 1; id <= 3; ++id) {
    BodyDef def;
    def.id = BodyId(id);
    def.kind = 1;
    def.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
    def.initial.position = {-5, 0, id == 1 ? 3.0 : -3.0 * static_cast<double>(id)};
    if (id == 1) def.initial.linear_velocity = {6, 0, 0};
    if (id == 3) {
      def.motion = Motion::kStatic;
      def.mass_kg = 0;
    }
    def.may_sleep = false;
    scene->bodies.push_back(std::move(def));
  }
  return scene;
}

constexpr char kCounting[] = "kinds.ball = { on_tick = function(self) self.count = self.count + 1 end }";

class LockstepWorldTest : public ::testing::Test {
 protected:
  void Begin(const std::string& source, const LockstepOptions& options = {}) {
    auto created = LockstepWorld::Create(*LuaGameModule(), {"game.lua", source}, FlyingBalls(), options);
    ASSERT_TRUE(created.ok()) << created.status();
    world = *std::move(created);
  }
  void Steps(int count) {
    for (int i = 0; i < count; ++i) {
      const absl::Status status = world->Step();
      ASSERT_TRUE(status.ok()) << status << " in step " << i;
    }
  }
  std::int64_t Count(BodyId body) { return std::get<std::int64_t>(world->PropertiesOf(body).front().second); }
  static tessera_game_value Value(BodyId body) {
    tessera_game_value value{};
    value.type = TESSERA_GAME_BODY;
    value.as.id = body.value();
    return value;
  }
  // The error, or nothing.
  std::string Set(BodyId body, const std::string& name, std::int64_t number) {
    tessera_game_value arguments[3] = {Value(body), {}, {}};
    arguments[1].type = TESSERA_GAME_TEXT;
    arguments[1].count = static_cast<std::uint32_t>(name.size());
    arguments[1].as.text = name.data();
    arguments[2].type = TESSERA_GAME_WHOLE;
    arguments[2].as.whole = number;
    std::string error;
    KeptValue result;
    return world->Call(kBodySet, arguments, result, error) ? "" : error;
  }

  std::unique_ptr<LockstepWorld> world;
};

TEST_F(LockstepWorldTest, ABodyGoesThroughRegionsAndIsCountedEachTick) {
  Begin(kCounting);
  const RegionId first = world->OwnerOf(kLockstepBall);
  Steps(100);
  EXPECT_NE(world->OwnerOf(kLockstepBall), first);
  EXPECT_GE(world->handovers(), 1U);
  EXPECT_EQ(Count(kLockstepBall), 100);
}

TEST_F(LockstepWorldTest, DeathsLoseNothing) {
  Begin(kCounting);
  for (int death = 1; death <= 6; ++death) {  // the fourth takes the last region, and all begin again
    Steps(10);
    ASSERT_TRUE(world->Kill(world->OwnerOf(kLockstepBall)).ok());
    ASSERT_NE(world->OwnerOf(kLockstepBall), RegionId());
    EXPECT_EQ(Count(kLockstepBall), 10 * death);
    EXPECT_EQ(Count(BodyId(2)), 10 * death);
  }
  EXPECT_EQ(world->deaths(), 6U);
  EXPECT_FALSE(world->Kill(RegionId(77)).ok());
}

// Put anywhere in four regions every few ticks, pushed, and floating or falling, while regions die.
TEST_F(LockstepWorldTest, WhatAGameDoesToMotionOutlivesDeaths) {
  constexpr char kRestless[] = R"(
    kinds.ball = {
      on_tick = function(self)
        if world.tick() % 7 == 0 then
          self:teleport(vec(world.random() * 36 - 18, 0, world.random() * 36 - 18), nil, { velocity = vec(1, 0, 0) })
          self.count = self.count + 1
        elseif world.tick() % 11 == 0 then
          self:push_for(4, vec(0, world.random() * 8 - 4, 0))
          self:set_spin(vec(0, world.random(), 0))
        elseif world.tick() % 13 == 0 then
          self:set_gravity(world.random() - 0.5)
          self:set_material({ friction = world.random(), restitution = 1 })
        end
      end,
    }
  )";
  Begin(kRestless, {.regions = 4, .seed = 3, .settings = {}});
  for (int death = 1; death <= 5; ++death) {
    Steps(50);
    ASSERT_TRUE(world->Kill(world->OwnerOf(kLockstepBall)).ok());
  }
  for (const GameLine& line : world->TakeLines()) ADD_FAILURE() << line.text;
  // A failover goes on some ticks later.
  EXPECT_GE(Count(kLockstepBall), 250 / 7);
  EXPECT_LE(Count(kLockstepBall), static_cast<std::int64_t>(world->tick().value() / 7));
  EXPECT_EQ(Count(BodyId(2)), Count(kLockstepBall));
  EXPECT_GT(world->handovers(), 20U);
}

TEST_F(LockstepWorldTest, ARegionMayDieBeforeTheFirstTick) {
  Begin(kCounting);
  ASSERT_TRUE(world->Kill(RegionId(1)).ok());
  Steps(3);
  EXPECT_EQ(Count(kLockstepBall), 3);
}

TEST_F(LockstepWorldTest, APlacedBodyIsThereAndKeepsItsRecord) {
  Begin(kCounting);
  Steps(5);
  ASSERT_TRUE(world->Place(kLockstepBall, [](BodyState& state) { state.position = {12, 0, 12}; }).ok());
  EXPECT_EQ(world->OwnerOf(kLockstepBall), RegionId(4));
  EXPECT_EQ(Count(kLockstepBall), 5);
  Steps(1);
  EXPECT_EQ(Count(kLockstepBall), 6);
  EXPECT_EQ(world->tick(), Tick(6));
  EXPECT_FALSE(world->Place(kLockstepWall, [](BodyState&) {}).ok());
}

TEST_F(LockstepWorldTest, ACallIsSeenAtOnceAndDoneInTheNextTick) {
  Begin(kCounting);
  Steps(1);
  EXPECT_EQ(Set(kLockstepBall, "count", 40), "");
  EXPECT_EQ(Count(kLockstepBall), 1);
  std::string error, name = "count";
  KeptValue result;
  tessera_game_value arguments[2] = {Value(kLockstepBall), {}};
  arguments[1].type = TESSERA_GAME_TEXT;
  arguments[1].count = 5;
  arguments[1].as.text = name.data();
  ASSERT_TRUE(world->Call(kBodyGet, arguments, result, error)) << error;
  EXPECT_EQ(result.Expose().as.whole, 40);
  Steps(1);
  EXPECT_EQ(Count(kLockstepBall), 41) << "40, and on_tick has counted on";
  EXPECT_THAT(Set(kLockstepBall, "mana", 1), HasSubstr("mana"));
  EXPECT_NE(Set(kLockstepWall, "count", 1), "") << "it does not move";
}

TEST_F(LockstepWorldTest, TheSameOptionsGiveTheSameBitsAlsoInFreshStates) {
  const std::string source =
      "kinds.ball = { on_tick = function(self) self:impulse(vec(0, world.random() - 0.5, 0)) end }";
  const auto play = [&](std::uint64_t seed, bool fresh) {
    LockstepOptions options;
    options.seed = seed;
    options.fresh_states = fresh;
    Begin(source, options);
    Steps(80);
    return world->Hash();
  };
  const std::uint64_t once = play(1, false);
  EXPECT_EQ(play(1, false), once);
  EXPECT_EQ(play(1, true), once);
  EXPECT_NE(play(2, false), once);
}

TEST_F(LockstepWorldTest, DrawnDeathsLoseNothing) {
  LockstepOptions options;
  options.deaths = true;
  for (options.seed = 1; options.seed <= 3; ++options.seed) {
    Begin(kCounting, options);
    Steps(400);
    EXPECT_GE(world->deaths(), 2U);
    EXPECT_EQ(Count(kLockstepBall), 400);
  }
}

// A module that keeps a number in its own memory, as no game may.
TEST_F(LockstepWorldTest, FreshStatesForgetWhatAGameKeeps) {
  static constexpr tessera_game_module kForgetful = {
      sizeof kForgetful,
      TESSERA_GAME_ABI,
      [](const tessera_game_host* host, const tessera_game_source*, void** game, tessera_game_error*) {
        *game = new std::pair<const tessera_game_host*, std::int64_t>(host, 0);
        return 0;
      },
      [](void* game) { delete static_cast<std::pair<const tessera_game_host*, std::int64_t>*>(game); },
      [](const void*, std::uint32_t callback, const char*) { return callback == kOnBodyTick ? 1 : 0; },
      [](void* game, tessera_game_call* call, const tessera_game_callback* event, tessera_game_error*) {
        auto& [host, number] = *static_cast<std::pair<const tessera_game_host*, std::int64_t>*>(game);
        tessera_game_value arguments[3] = {event->arguments[0], {}, {}}, result{};
        arguments[1].type = TESSERA_GAME_TEXT;
        arguments[1].count = 5;
        arguments[1].as.text = "count";
        arguments[2].type = TESSERA_GAME_WHOLE;
        arguments[2].as.whole = ++number;
        return host->call(call, kBodySet, arguments, 3, &result);
      },
      nullptr};
  for (const bool fresh : {false, true}) {
    LockstepOptions options;
    options.regions = 1;
    options.fresh_states = fresh;
    auto created = LockstepWorld::Create(kForgetful, {"game", ""}, FlyingBalls(), options);
    ASSERT_TRUE(created.ok()) << created.status();
    world = *std::move(created);
    Steps(3);
    EXPECT_EQ(Count(kLockstepBall), fresh ? 1 : 5) << "two balls a tick, this one first";
  }
}

TEST_F(LockstepWorldTest, WhatCannotBeLoadedIsSaid) {
  const auto refused = LockstepWorld::Create(*LuaGameModule(), {"game.lua", "oops"}, FlyingBalls(), {});
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("game.lua:1: "));
}

TEST_F(LockstepWorldTest, EventsForABackendAreTakenSoThatNoneIsLeftOut) {
  Begin(R"(kinds.ball = { on_tick = function(self) world.publish("tick") end })");
  Steps(static_cast<int>(kMaxPublished) / 2 + 100);
  EXPECT_THAT(world->TakeLines(), ::testing::IsEmpty());
}

}  // namespace
}  // namespace tessera::game
