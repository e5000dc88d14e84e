// A game in Lua keeps nothing: its globals, tables and functions do not change after loading.
#include <gmock/gmock.h>

#include <string>

#include "game_sdk/lua/testing/lua_module_fixture.h"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

TEST_F(LuaModuleTest, RefusesWritesToGlobals) {
  EXPECT_EQ(OnContact("count = 1"), "game.lua:2: `count` is written outside of loading; keep state in properties");
  ASSERT_EQ(Load("count = 1\nfunction on_tick() count = 2 end"), "");
  EXPECT_EQ(Tick(), "game.lua:2: `count` is written outside of loading; keep state in properties");
  EXPECT_EQ(OnContact("string.x = 1"),
            "game.lua:2: `string.x` is written outside of loading; keep state in properties");
  EXPECT_EQ(OnContact("kinds.crate.on_contact = nil"),
            "game.lua:2: `kinds.crate.on_contact` is written outside of loading; keep state in properties");
}

TEST_F(LuaModuleTest, RefusesWritesToFrozenTables) {
  const char* const kGame =
      "local deep = { a = { [3] = { ['x y'] = {} } } } deep.self = deep\n scores = { 1, 2, red = 1 }\n";
  const auto on_tick = [&](const std::string& statement) {
    EXPECT_EQ(Load(kGame + ("function on_tick() local _ = deep " + statement + " end")), "");
    return Tick();
  };
  constexpr char kRest[] = "` is written outside of loading; keep state in properties";
  EXPECT_EQ(on_tick("scores.red = 2"), std::string("game.lua:3: `scores.red") + kRest);
  EXPECT_EQ(on_tick("scores.blue = 2"), std::string("game.lua:3: `scores.blue") + kRest);
  EXPECT_EQ(on_tick("scores[1] = 2"), std::string("game.lua:3: `scores[1]") + kRest);
  EXPECT_EQ(on_tick("scores[{}] = 2"), std::string("game.lua:3: `scores[...]") + kRest);
  EXPECT_EQ(on_tick("deep.a[3]['x y'].z = 2"), std::string("game.lua:3: `deep.a[3][\"x y\"].z") + kRest);
  EXPECT_EQ(on_tick("deep.self.self.n = 2"), std::string("game.lua:3: `deep.n") + kRest);
  EXPECT_EQ(on_tick("table.insert(scores, 3)"), std::string("game.lua:3: `scores[3]") + kRest);
  EXPECT_EQ(on_tick("table.remove(scores)"), std::string("game.lua:3: `scores[2]") + kRest);
  EXPECT_EQ(on_tick("table.sort(scores)"), std::string("game.lua:3: `scores") + kRest);
  EXPECT_EQ(on_tick("table.move({ 1 }, 1, 1, 1, scores)"), std::string("game.lua:3: `scores") + kRest);
  EXPECT_THAT(on_tick("for k in pairs({ [deep] = 1 }) do end"), EndsWith("a key that is a table has no order"));
  EXPECT_EQ(on_tick("setmetatable(scores, {})"), std::string("game.lua:3: `scores") + kRest);
}

TEST_F(LuaModuleTest, ReadsFrozenTables) {
  ASSERT_EQ(Load("list = { 10, 20, 30, name = 'n' }\nnames = { b = 2, a = 1 }\nfunction on_tick()\n"
                 "local t = {} for i, v in ipairs(list) do t[#t + 1] = i .. '=' .. v end\n"
                 "for k, v in pairs(names) do t[#t + 1] = k .. '=' .. v end\n"
                 "print(table.concat(t, ' '), #list, table.unpack(list))\n"
                 "print(table.concat(list, ' '), list.name, list.none, next(names), rawlen(list), rawget(names, 'b'))\n"
                 "end"),
            "");
  ASSERT_EQ(Tick(), "");
  EXPECT_THAT(host_.lines,
              ElementsAre("log(\"1=10 2=20 3=30 a=1 b=2\t3\t10\t20\t30\")", "log(\"10 20 30\tn\tnil\ta\t3\t2\")"));
}

TEST_F(LuaModuleTest, KeepsMetatablesWorking) {
  ASSERT_EQ(Load(R"(
local Base = {} Base.__index = Base
function Base:name() return self.n end
local Point = setmetatable({}, { __index = Base, __call = function(_, n) return setmetatable({ n = n }, Point_) end })
Point.__index = Point
Point.__eq = function(a, b) return a.n == b.n end
Point.__add = function(a, b) return a.n + b.n end
Point.__tostring = function(a) return 'Point ' .. a.n end
Point.__len = function(a) return a.n * 100 end
Point.__lt = function(a, b) return a.n < b.n end
Point_ = Point
local frozen = Point(3)
local computed = setmetatable({ own = 1 }, { __index = function(t, k) return k .. t.own end })
function on_tick()
  local live = Point(3)
  print(frozen:name(), live:name(), frozen == live, frozen + live, frozen, live, #frozen, #live, frozen < live)
  print(getmetatable(live) == Point, getmetatable(frozen) == Point, computed.x, computed.own, Point.none)
  live.n = 4
  print(live:name(), rawget(live, 'n'))
  local ok, why = pcall(function() getmetatable(live).__index = nil end)
  print(why)
  ok, why = pcall(function() frozen.n = 4 end)
  print(why)
  ok, why = pcall(function() computed.z = 4 end)
  print(why)
end
)"),
            "");
  ASSERT_EQ(Tick(), "");
  EXPECT_THAT(
      host_.lines,
      ElementsAre("log(\"3\t3\ttrue\t6\tPoint 3\tPoint 3\t300\t300\tfalse\")", "log(\"true\ttrue\tx1\t1\tnil\")",
                  "log(\"4\t4\")",
                  "log(\"game.lua:20: `Point_.__index` is written outside of loading; keep state in properties\")",
                  "log(\"game.lua:22: `frozen.n` is written outside of loading; keep state in properties\")",
                  "log(\"game.lua:24: `computed.z` is written outside of loading; keep state in properties\")"));
}

TEST_F(LuaModuleTest, RefusesClosuresThatCount) {
  const auto refusal = [](int line, const std::string& name) {
    return "game.lua:" + std::to_string(line) + ": `" + name +
           "` would be kept between callbacks and lost with a handover; keep it in a property";
  };
  EXPECT_EQ(Load("local n = 0\nfunction on_tick()\nn = n + 1\nend"), refusal(3, "n"));
  // By a function within.
  EXPECT_EQ(Load("local n = 0\nfunction on_tick()\nlocal function f()\nreturn function() n = n + 1 end end f()() end"),
            refusal(4, "n"));
  // By a closure that a function returned while the file loaded.
  EXPECT_EQ(
      Load("local function counter() local n = 0\nreturn function() n = n + 1 return n end end\nnext_id = counter()"),
      refusal(2, "n"));
  // In a table, as a key, behind a metatable, and behind another function's variable.
  EXPECT_EQ(Load("local n = 0 t = { { f = function() n = 1 end } }"), refusal(1, "n"));
  EXPECT_EQ(Load("local n = 0 t = { [function() n = 1 end] = 1 }"), refusal(1, "n"));
  EXPECT_EQ(Load("local n = 0 t = setmetatable({}, { __index = function() n = 1 end })"), refusal(1, "n"));
  EXPECT_EQ(Load("local n = 0 local function f() n = 1 end function on_tick() f() end"), refusal(1, "n"));
  EXPECT_EQ(Load("function on_tick() _ENV = {} end"), refusal(1, "_ENV"));
  EXPECT_THAT(Load("local n, m = 0\nfunction a() m = 1 end"), HasSubstr("`m` would be kept"));
  EXPECT_EQ(Load("kinds.crate = setmetatable({}, { __index = function(_, name) local n = 0\n"
                 "return name == 'on_tick' and function() n = n + 1 end end })"),
            refusal(2, "n"));
  // The loop's own state.
  EXPECT_EQ(Load("f, s = pairs({ a = 1 })"), "game.lua: `s` keeps the state of a loop");
}

TEST_F(LuaModuleTest, AllowsCountersThatEndWithTheCall) {
  ASSERT_EQ(
      Load("local step = 1\nlocal loaded = 0\nlocal function note() loaded = loaded + 1 end note() note()\n"
           "local total = loaded\nstep = 2\n"
           "function on_tick()\nlocal n = 0\nlocal function inc() n = n + step end\ninc() inc() print(n, total)\nend"),
      "");
  ASSERT_EQ(Tick(), "");
  ASSERT_EQ(Tick(), "");
  EXPECT_THAT(host_.lines, ElementsAre("log(\"4\t2\")", "log(\"4\t2\")"));
}

TEST_F(LuaModuleTest, FreezesLongChainsAndCycles) {
  ASSERT_EQ(
      Load("local first = {} local last = first\nfor i = 1, 5000 do last.next = { i = i } last = last.next end\n"
           "last.next = first\nfunction on_tick() local t = first for i = 1, 5000 do t = t.next end t.next.x = 1 end"),
      "");
  EXPECT_EQ(Tick(), "game.lua:4: `first.x` is written outside of loading; keep state in properties");
}

}  // namespace
}  // namespace tessera::game
