// Games in Lua, run by the game host of a region.
#include <gmock/gmock.h>

#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "core/world/utf8.h"
#include "game_sdk/api/api.h"
#include "game_sdk/lua/lua_module.h"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class GameInLuaTest : public ::testing::Test {
 protected:
  void Load(const std::string& source) {
    auto loaded = GameHost::Load(*LuaGameModule(), {"game.lua", source}, world.shared_scene(), {}, 3);
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    host = *std::move(loaded);
  }
  void Run(std::vector<GameEvent> events = {}) { host->Run(++tick, events, world); }
  // Body 1 meets body 2, which is a neighbour's unless the test has said what it is.
  void Touch() {
    if (world.Find(BodyId(2)) == nullptr) world.Add(2, 0, false);
    Run({{kOnBodyContact, BodyId(1), BodyId(2)}});
  }
  std::vector<std::string> Lines() {
    std::vector<std::string> lines;
    for (const GameLine& line : host->TakeLines()) lines.push_back((line.error ? "error: " : "") + line.text);
    return lines;
  }

  FakeGameWorld world;
  std::unique_ptr<GameHost> host;
  Tick tick;
};

TEST_F(GameInLuaTest, ACrateThatIsHitLosesHealthAndBreaksLater) {
  world.Add(1, 1);
  world.Add(2, 2);
  Load(R"(
    local DAMAGE = 40
    kinds.crate = {
      on_contact = function(self, other)
        if other:kind() ~= "ball" then return end
        self.health = self.health - DAMAGE
        self:impulse(vec(0, 2, 0))
        if self.health < 50 then self:after(3, "break", { by = other }) end
      end,
      on_timer = function(self, name, values)
        print(name, "by", values.by, self.health)
      end,
    })");
  Touch();
  EXPECT_EQ(world.property(1, "health"), PropertyValue(std::int64_t{60}));
  EXPECT_THAT(world.record(1).timers, IsEmpty());
  EXPECT_EQ(world.record(1).push_ns, (Vec3f{0, 2, 0}));
  Touch();
  EXPECT_EQ(world.property(1, "health"), PropertyValue(std::int64_t{20}));
  EXPECT_THAT(world.record(1).timers, SizeIs(1));
  EXPECT_THAT(Lines(), IsEmpty());
  for (int i = 0; i < 3; ++i) Run();
  EXPECT_THAT(Lines(), ElementsAre("break by body 2 20"));
}

TEST_F(GameInLuaTest, VectorsBodiesAndBytesArePropertiesToo) {
  world.Add(1, 1);
  world.Add(2, 2);
  Load(R"(kinds.crate = {
      on_contact = function(self, other)
        print(self.home, self.target, #self.note)
        self.home = self.home + vec(0, 1, 0)
        self.target = other
        self.note = "\0\255"
        print(self.home, self.target:kind(), #self.note)
        if self.heat > 0.5 then self.target = nil end
        self.heat = self.heat + 1
      end,
    })");
  Touch();
  EXPECT_EQ(world.property(1, "home"), PropertyValue(Vec3d{1, 3, 3}));
  EXPECT_EQ(world.property(1, "target"), PropertyValue(BodyId(2)));
  EXPECT_EQ(world.property(1, "note"), PropertyValue(PropertyBytes{{0, 255}}));
  Touch();
  EXPECT_EQ(world.property(1, "target"), PropertyValue(BodyId()));
  EXPECT_THAT(Lines(), ElementsAre("(1, 2, 3) nil 0", "(1, 3, 3) ball 2", "(1, 3, 3) body 2 2", "(1, 4, 3) ball 2"));
}

TEST_F(GameInLuaTest, AWrongValueForAPropertyIsRefusedByItsName) {
  world.Add(1, 1);
  world.Add(2, 2);
  Load(R"(kinds.crate = {
      on_contact = function(self, other)
        print(pcall(function() self.home = vec(0/0, 0, 0) end))
        print(pcall(function() self.home = nil end))
        print(pcall(function() self.target = 7 end))
        print(pcall(function() self.health = other end))
        print(pcall(function() self.note = string.rep("x", 257) end))
      end,
    })");
  Touch();
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("`home` must be finite"), HasSubstr("property \"home\" is a vector"),
                                   HasSubstr("property \"target\" is a body"),
                                   HasSubstr("property \"health\" is a whole number"),
                                   HasSubstr("property \"note\" is longer than 256 bytes")));
}

TEST_F(GameInLuaTest, TheWorldHasPropertiesTimersAndMessages) {
  world.Add(1, 1);
  world.Add(2, 2);
  world.Add(kInstanceBody.value(), 0);
  Load(R"(
    function on_message(name, values, sender)
      world.goals = world.goals + values.count
      world.after(2, "cheer", { by = sender })
    end
    function on_timer(name, values)
      values.by:send(name)
    end
    kinds.crate = {
      on_contact = function(self, other) world.send("goal", { count = 3 }) end,
      on_message = function(self, name, values, sender) print(self, name, sender, world.goals) end,
    })");
  Touch();
  for (int i = 0; i < 8; ++i) Run();
  EXPECT_THAT(Lines(), ElementsAre("body 1 cheer nil 3"));
}

TEST_F(GameInLuaTest, WhatTheWorldDoesNotHaveIsNamed) {
  world.Add(1, 1);
  world.Add(2, 2);
  world.Add(kInstanceBody.value(), 0);
  const auto fails = [this](const std::string& statement) {
    Load("kinds.crate = { on_contact = function(self, other) " + statement + " end }");
    Touch();
    const std::vector<std::string> lines = Lines();
    return lines.empty() ? std::string() : lines[0];
  };
  EXPECT_EQ(fails("world.goals = 3"), "");
  EXPECT_THAT(fails("print(world.gaols)"), HasSubstr("get: no property \"gaols\"; the scene declares: goals"));
  EXPECT_THAT(fails("world.gaols = 3"), HasSubstr("no property \"gaols\""));
  EXPECT_THAT(fails("world.goals = 'many'"), HasSubstr("\"goals\" is a whole number"));
  EXPECT_THAT(fails("world.tick = 3"), HasSubstr("is written outside of loading"));
  EXPECT_THAT(fails("world.send('goal', { to = function() end })"), HasSubstr("send: `values.to`"));
}

TEST_F(GameInLuaTest, AnErrorNamesFileAndLineAndDiscardsTheCall) {
  world.Add(1, 1);
  world.Add(2, 2);
  Load(R"(kinds.crate = {
      on_contact = function(self, other)
        self.health = 1
        self.mana = 2
      end,
    })");
  Touch();
  EXPECT_EQ(world.property(1, "health"), PropertyValue(std::int64_t{100}));
  const std::vector<std::string> lines = Lines();
  ASSERT_THAT(lines, SizeIs(1));
  EXPECT_THAT(lines[0], HasSubstr("error: game.lua:4: "));
  EXPECT_THAT(lines[0], HasSubstr("mana"));
}

TEST_F(GameInLuaTest, AnEndlessLoopCostsItsBudgetAndNothingElse) {
  world.Add(1, 1);
  world.Add(2, 2);
  Load(R"(kinds.crate = { on_contact = function(self) self.on = true; while true do pcall(error) end end })");
  Touch();
  EXPECT_EQ(world.property(1, "on"), PropertyValue(false));
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("too much work")));
  EXPECT_LE(host->statistics().instructions, GameSettings().instructions_per_callback + 1);
  Touch();
  EXPECT_EQ(host->statistics().errors, 2U) << "it is called again";
}

TEST_F(GameInLuaTest, FreshStatesGiveTheSameEffects) {
  for (std::uint64_t id = 1; id <= 4; ++id) world.Add(id, 1);
  Load(R"(
    function on_tick() if world.tick() % 2 == 0 then print("even", world.random()) end end
    kinds.crate = {
      on_tick = function(self)
        local keys = {}
        for key in pairs({ z = 1, a = 2, [3] = 4 }) do keys[#keys + 1] = tostring(key) end
        self:impulse(vec(world.random(), math.random(6), #table.concat(keys, ",")))
        self.heat = world.random()
      end,
    })");
  const auto play = [&](bool renew) {
    std::vector<std::string> seen;
    tick = Tick();
    for (int i = 0; i < 6; ++i) {
      if (renew) {
        EXPECT_TRUE(host->Renew().ok());
      }
      Run();
      for (std::uint64_t id = 1; id <= 4; ++id) {
        const Vec3f push = world.record(id).push_ns;
        seen.push_back(std::to_string(push.x) + " " + std::to_string(push.y) + " " + std::to_string(push.z) + " " +
                       std::to_string(std::get<double>(world.property(id, "heat"))));
        world.Commit(BodyId(id), world.ChangedOf(BodyId(id)), {}, false);
      }
      for (const std::string& line : Lines()) seen.push_back(line);
    }
    return seen;
  };
  const std::vector<std::string> kept = play(false);
  EXPECT_EQ(play(true), kept);
  EXPECT_THAT(kept, SizeIs(27));
}

TEST_F(GameInLuaTest, ACrateThrowsABallThatExpires) {
  world.Add(1, 1);
  world.Add(2, 2);
  Load(R"(
    kinds.crate = {
      on_contact = function(self)
        local ball = world.spawn("ball", self:position() + vec(0, 2, 0), { velocity = vec(0, 5, 0), expire_after = 2 })
        ball.health = 3
        print("made", ball:is_own(), ball:velocity())
      end,
    })");
  Touch();
  EXPECT_THAT(Lines(), ElementsAre("made true (0, 5, 0)"));
  const BodyId ball = SpawnedBodyId({0, 1, 1, 0});
  EXPECT_THAT(world.ids(), ElementsAre(BodyId(1), BodyId(2), ball));
  EXPECT_EQ(world.property(ball.value(), "health"), PropertyValue(std::int64_t{3}));
  Run();
  EXPECT_THAT(world.ids(), SizeIs(3));
  Run();
  EXPECT_THAT(world.ids(), SizeIs(2));
}

TEST_F(GameInLuaTest, AMillionSpawnsAreRefusedWithTheirLineAndMakeNothing) {
  world.Add(1, 1);
  Load(R"(
    function on_tick()
      for i = 1, 1000000 do
        world.spawn("ball", vec(0, 50, 0))
      end
    end
    kinds.crate = { on_tick = function(self) self.health = self.health - 1 end }
  )");
  Run();
  EXPECT_THAT(Lines(), ElementsAre("error: game.lua:4: spawn: more bodies than a region may make in a tick"));
  EXPECT_THAT(world.ids(), ElementsAre(BodyId(1))) << "none of those that it could have made is there";
  EXPECT_EQ(host->statistics().spawned, 0U);
  EXPECT_EQ(host->statistics().errors, 1U);
  const auto spawns = host->statistics().effects[static_cast<std::size_t>(Effect::kSpawn)];
  EXPECT_EQ(spawns.discarded, GameSettings().spawns_per_tick);
  EXPECT_EQ(spawns.refused, 1U);
  EXPECT_EQ(world.property(1, "health"), PropertyValue(std::int64_t{99})) << "all else goes on in the same tick";
}

// One that goes on whatever it is told ends with its instructions.
TEST_F(GameInLuaTest, AMillionSpawnsThatIgnoreTheRefusalEndWithTheBudget) {
  world.Add(1, 1);
  Load(R"(
    function on_tick()
      for i = 1, 1000000 do
        pcall(world.spawn, "ball", vec(0, 50, 0))
      end
    end
    kinds.crate = { on_tick = function(self) self.health = self.health - 1 end }
  )");
  for (std::int64_t left = 99; left > 90; --left) {
    const std::uint64_t before = host->statistics().instructions;
    Run();
    EXPECT_THAT(Lines(), ElementsAre(HasSubstr("game.lua:4: too much work")));
    EXPECT_THAT(world.ids(), ElementsAre(BodyId(1)));
    EXPECT_LE(host->statistics().instructions - before, GameSettings().instructions_per_tick);
    EXPECT_EQ(world.property(1, "health"), PropertyValue(left));
  }
}

TEST_F(GameInLuaTest, ASpawnInsideAWallIsRefusedWithItsLineAndMakesNothing) {
  world.Add(1, 1);
  world.Add(9, 0, false);
  world.def(9).motion = Motion::kStatic;
  world.def(9).name = "wall";
  Load(R"(
    kinds.crate = {
      on_contact = function(self)
        self.health = 5
        world.spawn("ball", self:position())
      end,
    })");
  QueryHit hit;
  hit.body = BodyId(9);
  world.answer.hits = {hit};
  Touch();
  EXPECT_THAT(Lines(), ElementsAre("error: game.lua:5: spawn: \"ball\" would be inside static body 9 \"wall\""));
  EXPECT_EQ(world.property(1, "health"), PropertyValue(std::int64_t{100}));
  EXPECT_EQ(host->statistics().spawned, 0U);
  EXPECT_EQ(host->statistics().errors, 1U);
  ASSERT_THAT(world.asked, SizeIs(1));
  EXPECT_FALSE(world.asked[0].filter.dynamic_bodies) << "bodies that move are pushed out of each other";
  EXPECT_FALSE(world.asked[0].filter.triggers);
  world.answer.hits[0].fraction = 0.5;  // it begins outside
  Touch();
  EXPECT_EQ(host->statistics().spawned, 1U);
}

// A message with a text field that is not UTF-8 is refused as a whole by whoever parses it.
TEST_F(GameInLuaTest, LinesAreUtf8WhateverTheGameMakesOfThem) {
  Load(R"(
    function on_tick()
      print("a\xFF", "\xF0\x9F\x8E\xB2")
      if world.tick() > 1 then error("no \xC3") end
    end)");
  Run();
  EXPECT_THAT(Lines(), ElementsAre("a? \xF0\x9F\x8E\xB2"));
  Run();
  EXPECT_THAT(Lines(), ElementsAre("error: game.lua:4: no ?"));
  const auto bad = GameHost::Load(*LuaGameModule(), {"game.lua", "x = \xFF"}, world.shared_scene());
  EXPECT_TRUE(IsUtf8(std::string(bad.status().message()))) << bad.status();
}

TEST_F(GameInLuaTest, WhatWouldBeLostIsRefusedAtLoading) {
  const auto refused = [&](const std::string& source) {
    return std::string(GameHost::Load(*LuaGameModule(), {"game.lua", source}, world.shared_scene()).status().message());
  };
  EXPECT_THAT(refused("local n = 0\nfunction on_tick() n = n + 1 end"), HasSubstr("game.lua:2: `n`"));
  EXPECT_THAT(refused("kinds.crate = {\n  on_contcat = function() end }"), HasSubstr("did you mean on_contact?"));
  EXPECT_THAT(refused("function on_tick("), HasSubstr("game.lua:1: "));
}

TEST_F(GameInLuaTest, ARayGivesItsHitAsATableOrNothing) {
  world.Add(1, 1);
  Load(R"(kinds.crate = { on_contact = function(self, other)
      local hit = world.ray(vec(0, 1, 0), vec(0, 1, 10), { ignore = other, layers = { "default" } })
      if not hit then return print("nothing") end
      print(hit.body, hit.point, hit.normal, hit.fraction, hit.distance, hit.body == other)
    end })");
  world.Add(2, 2);
  Touch();
  world.answer = {.hits = {{BodyId(2), 0.25, {0, 1, 2.5}, {0, 0, -1}}}};
  Touch();
  EXPECT_THAT(Lines(), ElementsAre("nothing", "body 2 (0, 1, 2.5) (0, 0, -1) 0.25 2.5 true"));
  ASSERT_THAT(world.asked, SizeIs(2));
  EXPECT_THAT(world.asked[0].filter.ignored, ElementsAre(BodyId(1), BodyId(2)));
  EXPECT_EQ(world.asked[0].filter.layers, 1u);
}

TEST_F(GameInLuaTest, ManyHitsAreAListInTheirOrder) {
  world.Add(1, 1);
  world.answer.hits = {{BodyId(4), 0.1, {1, 0, 0}, {-1, 0, 0}}, {BodyId(3), 0.2, {2, 0, 0}, {-1, 0, 0}}};
  Load(R"(kinds.crate = { on_contact = function(self, other)
      for i, hit in ipairs(world.ray_all(vec(0, 0, 0), vec(10, 0, 0), { ignore = { self, other }, limit = 2 })) do
        print(i, hit.body, hit.distance)
      end
      for i, body in ipairs(world.overlap({ radius = 3 }, self:position(), { triggers = true })) do print(i, body) end
      local hit = world.sweep({ half_extents = vec(1, 2, 3), rotation = self:rotation() }, vec(0, 0, 0), vec(10, 0, 0))
      print(hit.body)
    end })");
  Touch();
  EXPECT_THAT(Lines(), ElementsAre("1 body 4 1.0", "2 body 3 2.0", "1 body 4", "2 body 3", "body 4"));
  ASSERT_THAT(world.asked, SizeIs(3));
  EXPECT_EQ(world.asked[0].most_hits, 2u);
  EXPECT_THAT(world.asked[0].filter.ignored, ElementsAre(BodyId(1), BodyId(1), BodyId(2)));
  EXPECT_TRUE(world.asked[1].filter.triggers);
  EXPECT_EQ(std::get<SphereShape>(world.asked[1].shape).radius_m, 3);
  EXPECT_EQ(std::get<BoxShape>(world.asked[2].shape).half_extents_m, (Vec3d{1, 2, 3}));
}

TEST_F(GameInLuaTest, OptionsMayBeAConstantOfTheFile) {
  world.Add(1, 1);
  Load(R"(local SHAPE, OPTIONS = { radius = 2 }, { layers = { "default" }, limit = 3 }
    kinds.crate = { on_contact = function(self) print(#world.overlap(SHAPE, self:position(), OPTIONS)) end })");
  Touch();
  EXPECT_THAT(Lines(), ElementsAre("0"));
  ASSERT_THAT(world.asked, SizeIs(1));
  EXPECT_EQ(world.asked[0].filter.layers, 1u);
  EXPECT_EQ(world.asked[0].most_hits, 3u);
}

TEST_F(GameInLuaTest, AWrongOptionIsNamedWithItsLine) {
  world.Add(1, 1);
  const auto error = [&](const std::string& call) {
    Load("kinds.crate = { on_contact = function(self)\n" + call + " end }");
    Touch();
    const std::vector<std::string> lines = Lines();
    return lines.empty() ? "no error" : lines[0];
  };
  EXPECT_EQ(error("world.ray(vec(0, 0, 0), vec(0, 0, 0))"), "error: game.lua:2: ray: `to` is the same point as `from`");
  EXPECT_EQ(error("world.ray(vec(0, 0, 0), vec(0, 0, 1), { layers = { 'dust' } })"),
            "error: game.lua:2: ray: `options.layers` names \"dust\", which the scene does not; its layers: default");
  EXPECT_EQ(error("world.ray(vec(0, 0, 0), vec(0, 0, 1), { layers = { a = 'default' } })"),
            "error: game.lua:2: ray: `options.layers` must be a list of at most 64");
  EXPECT_THAT(error("world.ray(vec(0, 0, 0), vec(0, 0, 1), { ignore = { {} } })"),
              HasSubstr("error: game.lua:2: ray: `options.ignore` must be "));
  EXPECT_EQ(error("world.ray(vec(0, 0, 0), vec(0, 0, 0 / 0))"), "error: game.lua:2: ray: `to` must be finite");
  EXPECT_THAT(error("world.overlap(3, vec(0, 0, 0))"),
              HasSubstr("overlap: `shape` must be a table of named values, got a whole number"));
  EXPECT_THAT(error("self:after(3, 'x', { list = { 1 } })"), HasSubstr("after: `values.list` must be "))
      << "what is kept may hold no lists";
}

TEST_F(GameInLuaTest, AGameThatTakesAnothersPlaceMigratesEachBodyOnce) {
  world.Add(1, 1);
  world.Add(2, 1);
  Load("kinds.crate = { on_contact = function(self) self:after(3, 'old') end }");
  Touch();
  const std::string second = R"(
    kinds.crate = {
      on_migrate = function(self, from)
        self.health = self.health - 10
        print(self, from)
        if self.health == 40 then error("no") end
      end,
      on_timer = function(self, name) print(name, world.time()) end,
    })";
  auto next = GameHost::Load(*LuaGameModule(), {"next.lua", second}, world.shared_scene(), {}, 3, 2);
  ASSERT_TRUE(next.ok()) << next.status();
  (*next)->TakeOver(*host);
  EXPECT_EQ((*next)->statistics().calls, host->statistics().calls) << "figures go on";
  host = *std::move(next);
  Run();
  EXPECT_THAT(Lines(), ElementsAre("body 1 0", "body 2 0"));
  EXPECT_EQ(world.property(1, "health"), PropertyValue(std::int64_t{90}));
  EXPECT_EQ(world.record(1).game, 2u);
  Run();
  EXPECT_THAT(Lines(), IsEmpty()) << "once for each body";
  Run();
  EXPECT_THAT(Lines(), ElementsAre("old 0.066666666666667")) << "timers of the old game are the new one's";
}

TEST_F(GameInLuaTest, AMigrationThatFailsLeavesTheBodyAsItWasAndIsNotRepeated) {
  world.Add(1, 1);
  auto next = GameHost::Load(
      *LuaGameModule(), {"next.lua", "kinds.crate = { on_migrate = function(self) self.health = 1; error('no') end }"},
      world.shared_scene(), {}, 3, 1);
  ASSERT_TRUE(next.ok()) << next.status();
  host = *std::move(next);
  for (int i = 0; i < 3; ++i) Run();
  EXPECT_THAT(Lines(), SizeIs(1));
  EXPECT_EQ(host->statistics().errors, 1u);
  EXPECT_EQ(world.property(1, "health"), PropertyValue(std::int64_t{100}));
  EXPECT_EQ(world.record(1).game, 1u);
}

TEST_F(GameInLuaTest, CountersCountWithTheRestOfTheCallOrNotAtAll) {
  world.Add(1, 1);
  world.Add(2, 1);
  Load(R"(
    kinds.crate = {
      on_contact = function(self)
        world.count("goals")
        world.count("metres_run", 7)
        if world.tick() == 2 then error("no") end
      end,
    })");
  Touch();
  Touch();
  Touch();
  EXPECT_THAT(host->counters(), ElementsAre(std::pair("goals", 2u), std::pair("metres_run", 14u)));
  EXPECT_EQ(host->costs().at("kinds.crate.on_contact").calls, 3u);
  EXPECT_EQ(host->costs().at("kinds.crate.on_contact").errors, 1u);
  EXPECT_THAT(Lines(), SizeIs(1));
}

TEST_F(GameInLuaTest, ACounterThatIsNoneIsNamedAndAThirtyThirdIsLeftOut) {
  Load(R"(
    function on_tick()
      if world.tick() == 1 then world.count("Goals!") end
      if world.tick() == 2 then world.count("goals", -1) end
      if world.tick() == 3 then for i = 1, 40 do world.count("c" .. i) end end
    end)");
  for (int i = 0; i < 3; ++i) Run();
  EXPECT_THAT(Lines(), ElementsAre(testing::HasSubstr("count: `name` must be 1 to 64 of the characters a-z, 0-9 and _"),
                                   testing::HasSubstr("count: `more` is -1; it must be 0 to 1000000")));
  EXPECT_EQ(host->counters().size(), kMaxCounters);
  EXPECT_EQ(host->statistics().dropped_counts, 8u);
}

}  // namespace
}  // namespace tessera::game
