#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "game_sdk/lua/testing/lua_module_fixture.h"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// --- Callbacks

TEST_F(LuaModuleTest, KnowsItsCallbacks) {
  ASSERT_EQ(Load("function on_tick() end kinds.crate = { on_timer = function() end }"), "");
  EXPECT_TRUE(module_->handles(game_, kOnTick, nullptr));
  EXPECT_TRUE(module_->handles(game_, kOnBodyTimer, "crate"));
  EXPECT_FALSE(module_->handles(game_, kOnBodyTimer, "door"));
  EXPECT_FALSE(module_->handles(game_, kOnBodyContact, "crate"));
  EXPECT_FALSE(module_->handles(game_, kOnBodyTimer, nullptr));
  EXPECT_FALSE(module_->handles(game_, kOnTick, "crate"));
  EXPECT_FALSE(module_->handles(game_, 999, nullptr));
  EXPECT_EQ(Run(kOnBodyContact, "door", {Body(1), Body(2)}), "game.lua: the game has no such callback");
}

TEST_F(LuaModuleTest, RefusesMisspeltCallbacks) {
  EXPECT_EQ(Load("\n\nkinds.crate = {\n  on_contcat = function() end }"),
            "game.lua:4: kinds.crate.on_contcat is no callback of bodies; did you mean on_contact?");
  EXPECT_EQ(Load("\nfunction on_tik() end"), "game.lua:2: on_tik is no callback of the world; did you mean on_tick?");
  EXPECT_EQ(Load("kinds.crate = { speed = 3 }"), "game.lua: kinds.crate.speed is no callback of bodies");
  EXPECT_EQ(Load("kinds.crate = { on_tick = 3 }"),
            "game.lua: kinds.crate.on_tick must be a function, got a whole number");
  EXPECT_EQ(Load("kinds.crate = 3"), "game.lua: kinds.crate must be a table of callbacks, got a whole number");
  EXPECT_EQ(Load("kinds = 3"), "game.lua: kinds must be a table of tables of callbacks");
  EXPECT_EQ(Load("on_tick = 3"), "game.lua: on_tick must be a function, got a whole number");
}

TEST_F(LuaModuleTest, TakesCallbacksFromMetatables) {
  ASSERT_EQ(Load("local base = { on_contact = function(self) self:impulse(vec(1, 2, 3)) end }\n"
                 "kinds.crate = setmetatable({}, { __index = base })"),
            "");
  EXPECT_EQ(Contact(), "");
  EXPECT_THAT(host_.lines, ElementsAre("impulse(body 2, (1, 2, 3))"));
}

TEST_F(LuaModuleTest, RunsTheExampleOfTheHeader) {
  ASSERT_EQ(Load(R"(
local SPEED = 3
function on_tick() world.log("tick " .. world.tick()) end
kinds.crate = {
  on_contact = function(self, other)
    if other:kind() == "player" then self.health = self.health - 1 end
    self:impulse(vec(0, 5, 0) * SPEED)
  end,
  on_timer = function(self, name, values) print(self, name, values.n) end,
})"),
            "");
  EXPECT_EQ(Tick(), "");
  EXPECT_EQ(Contact(), "");
  tessera_game_field field{"n", 1, {}};
  field.value.type = TESSERA_GAME_REAL;
  field.value.as.real = 1.5;
  tessera_game_value values{};
  values.type = TESSERA_GAME_FIELDS;
  values.count = 1;
  values.as.fields = &field;
  EXPECT_EQ(Run(kOnBodyTimer, "crate", {Body(2), Text("door"), values}), "");
  EXPECT_THAT(host_.lines, ElementsAre("log(\"tick 42\")", "set(body 2, \"health\", 9)", "impulse(body 2, (0, 15, 0))",
                                       "log(\"body 2\tdoor\t1.5\")"));
}

// --- Handles, vectors, rotations

TEST_F(LuaModuleTest, ComparesHandlesById) {
  EXPECT_EQ(Value("self == other, self == self, tostring(self), type(self)"), "false\ttrue\tbody 2\tbody");
  EXPECT_EQ(Value("other:player(), self:player(), type(other:player()), other:player() == other:player()"),
            "player 1\tnil\tplayer\ttrue");
  EXPECT_EQ(OnContact("local t = {}; t[other:player()] = 1; assert(t[other:player()] == 1)"), "");
  EXPECT_EQ(Value("getmetatable(self)"), "false");
  EXPECT_EQ(OnContact("other:player().score = 1"), "game.lua:2: a player has no fields that can be written");
  EXPECT_EQ(OnContact("return other:player().score"), "game.lua:2: a player has no `score`");
}

TEST_F(LuaModuleTest, CalculatesWithVectors) {
  EXPECT_EQ(Value("vec(1, 2, 3) + vec(.5, 0, 0), vec(1, 2, 3) - vec(1, 1, 1), -vec(1, 2, 3)"),
            "(1.5, 2, 3)\t(0, 1, 2)\t(-1, -2, -3)");
  EXPECT_EQ(Value("vec(1, 2, 3) * 2, 2 * vec(1, 2, 3), vec(1, 2, 3) / 2"), "(2, 4, 6)\t(2, 4, 6)\t(0.5, 1, 1.5)");
  EXPECT_EQ(Value("vec(1, 2, 3) == vec(1, 2, 3), vec(1, 2, 3) == vec(1, 2, 4), vec(1, 2, 3) == 3"),
            "true\tfalse\tfalse");
  EXPECT_EQ(Value("vec(3, 4, 0):length(), vec(1, 2, 3):dot(vec(4, 5, 6))"), "5.0\t32.0");
  EXPECT_EQ(Value("vec(1, 0, 0):cross(vec(0, 1, 0)), vec(0, 3, 4):normalized(), vec(0, 0, 0):normalized()"),
            "(0, 0, 1)\t(0, 0.6, 0.8)\t(0, 0, 0)");
  EXPECT_EQ(Value("vec(1, 2, 3).x, vec(1, 2, 3).z, type(vec(0, 0, 0))"), "1.0\t3.0\tvector");
  EXPECT_EQ(Value("self:rotation():apply(vec(1, 0, 0)).y, self:rotation().z"), "1.0\t0.70710678118655");
  EXPECT_THAT(OnContact("vec(1, 2, 3).x = 4"), StartsWith("game.lua:2: a vector does not change"));
  EXPECT_EQ(OnContact("return vec(1, 2, 3).lenght"), "game.lua:2: a vector has no `lenght`");
  EXPECT_EQ(OnContact("return vec(1, 2)"), "game.lua:2: vec: takes 3 numbers, got 2 values");
  EXPECT_THAT(OnContact("return vec(1, 2, 3) * vec(1, 2, 3)"), HasSubstr("v:dot(w)"));
  EXPECT_EQ(OnContact("return vec(1, 2, 3) + 1"), "game.lua:2: vector +: needs a vector, got a whole number");
}

// --- Arguments

TEST_F(LuaModuleTest, RefusesWrongArguments) {
  EXPECT_EQ(OnContact("self:impulse('up')"), "game.lua:2: impulse: `impulse` must be a vector, got a text");
  EXPECT_EQ(OnContact("self:impulse()"), "game.lua:2: impulse: `impulse` is missing; it must be a vector");
  EXPECT_EQ(OnContact("self:impulse(vec(1, 2, 3), 4)"),
            "game.lua:2: impulse: `point` must be a vector or nothing, got a whole number");
  EXPECT_EQ(OnContact("self:impulse(vec(1, 2, 3), nil, 4)"), "game.lua:2: impulse: takes 2 arguments, got 3");
  EXPECT_EQ(OnContact("self.impulse(vec(1, 2, 3))"),
            "game.lua:2: impulse: call it as body:impulse(...), got a vector in front");
  EXPECT_EQ(OnContact("self:after(1.5, 'x')"), "game.lua:2: after: `ticks` must be a whole number, got 1.5");
  EXPECT_EQ(OnContact("self:after('1', 'x')"), "game.lua:2: after: `ticks` must be a whole number, got a text");
  EXPECT_EQ(OnContact("self:after(1, 2)"), "game.lua:2: after: `name` must be a text, got a whole number");
  EXPECT_EQ(OnContact("world.log({})"), "game.lua:2: log: `text` must be a text, got a table");
  EXPECT_EQ(
      OnContact("self.health = {}"),
      "game.lua:2: set: `health` must be true or false, a number, a text, a vector, a body or nothing, got a table");
  EXPECT_EQ(OnContact("self[1] = 2"), "game.lua:2: set: `name` must be a text, got a whole number");
  EXPECT_THAT(host_.lines, IsEmpty());
}

TEST_F(LuaModuleTest, RefusesNanAndInfinities) {
  EXPECT_EQ(OnContact("self:impulse(vec(0 / 0, 0, 0))"), "game.lua:2: impulse: `impulse` must be finite");
  EXPECT_EQ(OnContact("self:impulse(vec(0, 0, 1 / 0))"), "game.lua:2: impulse: `impulse` must be finite");
  EXPECT_EQ(OnContact("self:after(math.huge, 'x')"), "game.lua:2: after: `ticks` must be finite");
  EXPECT_EQ(OnContact("self.speed = -math.huge"), "game.lua:2: set: `speed` must be finite");
  EXPECT_EQ(OnContact("self:after(1, 'x', { n = 0 / 0 })"), "game.lua:2: after: `values.n` must be finite");
  EXPECT_THAT(host_.lines, IsEmpty());
}

TEST_F(LuaModuleTest, ConvertsNumbers) {
  ASSERT_EQ(OnContact("self:after(3.0, 'x'); self.speed = 2.0; self.speed = 2.5; self.speed = 2^63"), "");
  EXPECT_THAT(host_.lines,
              ElementsAre("after(body 2, 3, \"x\")", "set(body 2, \"speed\", 2)", "set(body 2, \"speed\", real 2.5)",
                          "set(body 2, \"speed\", real 9.2233720368548e+18)"));
}

TEST_F(LuaModuleTest, ConvertsNamedValues) {
  ASSERT_EQ(OnContact("local id = self:after(1, 'x', { z = true, a = 1, b = 2.0, c = 'text', d = vec(1, 2, 3),\n"
                      "  e = other, f = other:player() })\nassert(id == 5)\nself:after(2, 'y', {})"),
            "");
  EXPECT_THAT(host_.lines, ElementsAre("after(body 2, 1, \"x\", {a=1, b=real 2, c=\"text\", d=(1, 2, 3), e=body 3, "
                                       "f=player 1, z=true})",
                                       "after(body 2, 2, \"y\", {})"));
  EXPECT_THAT(OnContact("self:after(1, 'x', { a = {} })"), StartsWith("game.lua:2: after: `values.a` must be true or"));
  EXPECT_EQ(OnContact("self:after(1, 'x', { 1, 2 })"),
            "game.lua:2: after: `values` has a key that is a whole number; its keys must be texts");
  EXPECT_EQ(OnContact("local t = {} for i = 1, 65 do t['k' .. i] = i end self:after(1, 'x', t)"),
            "game.lua:2: after: `values` has more than 64 values");
  EXPECT_THAT(OnContact("self:after(1, 'x', { a = print })"), EndsWith("got a function"));
}

TEST_F(LuaModuleTest, TakesFrozenNamedValues) {
  ASSERT_EQ(Load("local values = { b = 2, a = 1 }\n"
                 "kinds.crate = { on_contact = function(self) self:after(1, 'x', values) end }"),
            "");
  EXPECT_EQ(Contact(), "");
  EXPECT_THAT(host_.lines, ElementsAre("after(body 2, 1, \"x\", {a=1, b=2})"));
}

TEST_F(LuaModuleTest, RaisesErrorsOfTheHost) {
  EXPECT_EQ(OnContact("self.helth = 1"), "game.lua:2: set: no property `helth`");
  EXPECT_EQ(OnContact("return self.helth"), "game.lua:2: get: no property `helth`");
  EXPECT_EQ(OnContact("self:impuls(vec(1, 2, 3))"),
            "game.lua:2: get: no property `impuls`; did you mean the function impulse?");
  EXPECT_EQ(OnContact("self:cancel(3)"), "game.lua:2: cancel: the body is gone");
  EXPECT_EQ(OnContact("self.mass = 3"), "game.lua:2: `mass` is a function of bodies, and no property");
  EXPECT_EQ(Value("pcall(self.cancel, self, 3)"), "false\tgame.lua:2: cancel: the body is gone");
}

TEST_F(LuaModuleTest, HasNoWorldWhileLoading) {
  EXPECT_EQ(Load("\nworld.tick()"), "game.lua:2: tick: there is no world while the file is loaded");
  EXPECT_EQ(Load("print(1)"), "game.lua:1: print: there is no world while the file is loaded");
  EXPECT_EQ(Load("math.random()"), "game.lua:1: random: there is no world while the file is loaded");
  EXPECT_THAT(host_.lines, IsEmpty());
}

// --- Determinism

TEST_F(LuaModuleTest, VisitsKeysInOrder) {
  EXPECT_EQ(OnContact("local t = { b = 1, a = 2, [10] = 3, [9] = 4, [2.5] = 5, [true] = 6, [false] = 7, B = 8,\n"
                      "  [-math.huge] = 9, [math.huge] = 10, [math.maxinteger] = 11, [''] = 12, ab = 13 }\n"
                      "local keys = {} for key in pairs(t) do keys[#keys + 1] = tostring(key) end\n"
                      "world.log(table.concat(keys, ' '))"),
            "");
  EXPECT_THAT(host_.lines, ElementsAre("log(\"-inf 2.5 9 10 9223372036854775807 inf  B a ab b false true\")"));
  EXPECT_EQ(OnContact("for key in pairs({ [self] = 1 }) do end"),
            "game.lua:2: pairs: a key that is a body has no order");
  EXPECT_EQ(OnContact("for key in pairs({ [{}] = 1 }) do end"),
            "game.lua:2: pairs: a key that is a table has no order");
  EXPECT_EQ(Value("next({ b = 1, a = 2 })"), "a\t2");
  EXPECT_EQ(Value("next({})"), "nil");
  EXPECT_THAT(OnContact("local t = { 1, 2 } next(t, 1)"), StartsWith("game.lua:2: next: takes a table only"));
}

TEST_F(LuaModuleTest, AllowsChangesWhileItVisits) {
  EXPECT_EQ(OnContact("local t = { a = 1, b = 2, c = 3 }\n"
                      "for key, value in pairs(t) do world.log(key .. value) t.b = nil t.c = 4 t.d = 5 end"),
            "");
  EXPECT_THAT(host_.lines, ElementsAre("log(\"a1\")", "log(\"c4\")"));
  // The result of a loop follows from its state and the key alone.
  EXPECT_EQ(
      Value("(function() local f, s = pairs({ a = 1, b = 2, c = 3 }) f(s, 'b') return f(s, 'a'), f(s, 'b') end)()"),
      "b\tc\t3");
  EXPECT_THAT(OnContact("local f, s = pairs({ a = 1 }) f(s, 'x')"), EndsWith("its function is for loops only"));
  EXPECT_THAT(OnContact("local f = pairs({}) f({}, nil)"), EndsWith("its function is for loops only"));
  EXPECT_EQ(
      Value("(function() for k, v in pairs(setmetatable({}, { __pairs = function() return next, { a = 7 } end })) "
            "do return k, v end end)()"),
      "a\t7");
}

TEST_F(LuaModuleTest, ShowsNoAddresses) {
  EXPECT_EQ(Value("tostring({}), tostring(print), tostring(function() end), tostring(pairs({}))"),
            "table\tfunction\tfunction\tfunction");
  EXPECT_EQ(Value("string.format('%s %s %5s|%-5s|%.2s', {}, nil, 'ab', 'cd', 'efg')"), "table nil    ab|cd   |ef");
  EXPECT_THAT(OnContact("return ('%p'):format({})"), StartsWith("game.lua:2: string.format: there is no %p"));
  EXPECT_EQ(OnContact("return 'x' .. {}"), "game.lua:2: attempt to concatenate a table value");
  EXPECT_EQ(Value("setmetatable({}, { __tostring = function() return 'mine' end })"), "mine");
  EXPECT_EQ(Value("string.format('%s', setmetatable({}, { __tostring = function() return 'mine' end }))"), "mine");
  EXPECT_EQ(OnContact("tostring(setmetatable({}, { __tostring = function() return 1 end }))"),
            "game.lua:2: __tostring must return a text, got a whole number");
}

TEST_F(LuaModuleTest, TakesRandomNumbersFromTheWorld) {
  EXPECT_EQ(
      OnContact("for i = 1, 1000 do local n = math.random(3) assert(n >= 1 and n <= 3 and math.type(n) == 'integer')\n"
                "local m = math.random(-2, 2) assert(m >= -2 and m <= 2)\n"
                "local r = math.random() assert(r >= 0 and r < 1) end"),
      "");
  EXPECT_EQ(host_.random_calls, 3000u);
  EXPECT_EQ(OnContact("math.random(0)"), "game.lua:2: random: there is no whole number from 1 to 0");
  EXPECT_EQ(OnContact("math.random(math.mininteger, math.maxinteger)"), "game.lua:2: random: more than 2^53 numbers");
}

TEST_F(LuaModuleTest, SortsStably) {
  EXPECT_EQ(OnContact("local list = {} for i = 1, 500 do list[i] = { key = i * 7 % 10, i = i } end\n"
                      "table.sort(list, function(a, b) return a.key < b.key end)\n"
                      "for i = 2, 500 do local a, b = list[i - 1], list[i]\n"
                      "assert(a.key < b.key or a.key == b.key and a.i < b.i) end"),
            "");
  EXPECT_EQ(Value("(function() local t = { 3, 1, 2.5, -1 } table.sort(t) return table.concat(t, ' ') end)()"),
            "-1 1 2.5 3");
  EXPECT_EQ(
      Value("(function() local t = { 'b', 'a' } table.sort(t, function(a, b) return a > b end) return t[1] end)()"),
      "b");
  EXPECT_EQ(OnContact("table.sort({ 1, 'a' })"), "game.lua:2: attempt to compare string with number");
  EXPECT_EQ(OnContact("table.sort({ 2, 1 }, function() error('no') end)"), "game.lua:2: no");
}

// Runs all kinds of things and returns the host's calls.
constexpr char kBusyGame[] = R"(
local Counter = {}
Counter.__index = Counter
function Counter.new() return setmetatable({ n = 0 }, Counter) end
function Counter:add(k) self.n = self.n + k return self end
local weights = { crate = 2, player = 3, [1] = 4, [true] = 5 }
kinds.crate = { on_contact = function(self, other)
  local c = Counter.new()
  for key, value in pairs(weights) do c:add(value) world.log(tostring(key) .. " " .. c.n) end
  local t = {}
  for i = 1, 200 do t["key" .. i] = math.random(100) end
  for key, value in pairs(t) do c:add(value) t[key] = nil end
  local seen = { [self] = true, [other] = true }
  assert(seen[other] and seen[self])
  local list = {}
  for i = 1, 150 do list[i] = math.random(10) end
  table.sort(list)
  print(c.n, table.concat(list), self, other, {}, print, weights)
  self.health = self.health + #list
  self:impulse((other:position() - self:position()):normalized() * c.n)
  self:after(1, "again", { list = table.concat(list, ",", 1, 5), who = other })
end }
)";

TEST_F(LuaModuleTest, GivesTheSameCallsInEachRun) {
  std::vector<std::string> first;
  for (int run = 0; run < 3; ++run) {
    ASSERT_EQ(Load(kBusyGame), "");
    host_.lines.clear();
    host_.random_calls = 0;
    for (int i = 0; i < 20; ++i) ASSERT_EQ(Contact(), "");
    if (run == 0) first = host_.lines;
    EXPECT_EQ(host_.lines, first);
  }
  EXPECT_EQ(first.size(), 20u * 8);
}

TEST_F(LuaModuleTest, GivesTheSameCallsInAFreshState) {
  ASSERT_EQ(Load(kBusyGame), "");
  std::vector<std::uint64_t> work, fresh_work;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(Contact(), "");
    work.push_back(host_.work);
  }
  const std::vector<std::string> kept = std::exchange(host_.lines, {});
  host_.random_calls = 0;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(Load(kBusyGame), "");
    ASSERT_EQ(Contact(), "");
    fresh_work.push_back(host_.work);
  }
  EXPECT_EQ(host_.lines, kept);
  EXPECT_EQ(fresh_work, work);
}

// --- Globals

TEST_F(LuaModuleTest, OffersNothingThatIsDangerous) {
  for (const char* const name : {"rawset", "collectgarbage", "load", "loadstring", "dofile", "loadfile", "require",
                                 "package", "io", "os", "debug", "coroutine", "xpcall", "warn", "_G"}) {
    EXPECT_THAT(OnContact(std::string("return ") + name), StartsWith(std::string("game.lua:2: `") + name + "` is not"));
  }
  EXPECT_EQ(Value("string.dump, math.randomseed, utf8.codepoint"), "nil\tnil\tnil");
  EXPECT_THAT(Load("setmetatable({}, { __gc = print })"), EndsWith("setmetatable: __gc is not supported"));
  EXPECT_THAT(OnContact("setmetatable({}, { __mode = 'k' })"), EndsWith("setmetatable: __mode is not supported"));
  EXPECT_EQ(Value("getmetatable('')"), "false");
  EXPECT_EQ(Value("getmetatable(setmetatable({}, { __metatable = 'mine' }))"), "mine");
  EXPECT_EQ(OnContact("setmetatable(setmetatable({}, { __metatable = 1 }), {})"),
            "game.lua:2: cannot change a protected metatable");
  EXPECT_EQ(Value("select('#', 1, 2), tonumber('12'), rawequal(1, 1), rawlen({ 1, 2 }), rawget({ a = 1 }, 'a')"),
            "2\t12\ttrue\t2\t1");
  EXPECT_EQ(Value("utf8.len('h\\u{e4}'), #utf8.char(228)"), "2\t2");
}

TEST_F(LuaModuleTest, PrintsToTheLog) {
  ASSERT_EQ(OnContact("print(1, 'a', nil, {}, vec(1, 2, 3)) print(('x'):rep(199) .. '\\u{e4}') print()"), "");
  EXPECT_THAT(host_.lines, ElementsAre("log(\"1\ta\tnil\ttable\t(1, 2, 3)\")", "log(\"" + std::string(199, 'x') + "\")",
                                       "log(\"\")"));
}

// --- Texts and tables

TEST_F(LuaModuleTest, HandlesTexts) {
  EXPECT_EQ(Value("('a.b.c'):find('.'), ('abc'):find('c', -1), ('abc'):find('x'), ('abc'):find('', 10)"),
            "2\t3\tnil\tnil");
  EXPECT_EQ(Value("('abc'):find('b', 1, true)"), "2\t2");
  EXPECT_THAT(OnContact("('abc'):find('b', 1, false)"), StartsWith("game.lua:2: string.find: there are no patterns"));
  EXPECT_EQ(Value("table.concat(('a,b,,c'):split(','), '|'), #(''):split(',')"), "a|b||c\t1");
  EXPECT_EQ(OnContact("('a'):split('')"), "game.lua:2: string.split: the separator is empty");
  EXPECT_EQ(Value("('aXbXc'):replace('X', '--'), ('abc'):replace('x', 'y')"), "a--b--c\tabc");
  EXPECT_EQ(OnContact("('a'):replace('', 'b')"), "game.lua:2: string.replace: the text to look for is empty");
  EXPECT_EQ(Value("('abc'):upper(), ('ABC'):lower(), ('abc'):reverse(), ('abc'):sub(2), ('abc'):len()"),
            "ABC\tabc\tcba\tbc\t3");
  EXPECT_EQ(Value("('ab'):rep(3, '-'), ('abc'):byte(-1), string.char(65, 66)"), "ab-ab-ab\t99\tAB");
  for (const char* const name : {"match", "gmatch", "gsub"}) {
    EXPECT_EQ(OnContact(std::string("return ('a'):") + name + "('a')"),
              std::string("game.lua:2: string.") + name +
                  ": there are no patterns; use string.find, string.split or string.replace, which take plain texts");
  }
}

TEST_F(LuaModuleTest, Formats) {
  EXPECT_EQ(Value("string.format('%d %5.2f|%-4d|%04x %c %% %g %i', 3.0, 1.5, 7, 255, 65, .1, -1)"),
            "3  1.50|7   |00ff A % 0.1 -1");
  EXPECT_EQ(OnContact("('%d'):format(1.5)"), "game.lua:2: string.format: value 1 must be a whole number, got a number");
  EXPECT_EQ(OnContact("('%f'):format('x')"), "game.lua:2: string.format: value 1 must be a number, got a text");
  EXPECT_EQ(OnContact("('%d'):format()"), "game.lua:2: string.format: value 1 is missing");
  EXPECT_THAT(OnContact("('%y'):format(1)"), HasSubstr("string.format: `%y` is unknown"));
  EXPECT_THAT(OnContact("('%'):format(1)"), HasSubstr("is unknown"));
  EXPECT_EQ(OnContact("assert(#('%99.99f'):format(1e308) == 409)"), "");
}

TEST_F(LuaModuleTest, BoundsResults) {
  EXPECT_EQ(OnContact("('x'):rep(1 << 40)"), "game.lua:2: string.rep: the text has more than 64 KiB");
  EXPECT_EQ(OnContact("(''):rep(math.maxinteger)"), "game.lua:2: string.rep: the text has more than 64 KiB");
  EXPECT_EQ(OnContact("assert(#('x'):rep(65536) == 65536)"), "");
  EXPECT_EQ(OnContact("local s = ('x'):rep(60000) return s:replace('x', 'xx')"),
            "game.lua:2: string.replace: the text has more than 64 KiB");
  EXPECT_EQ(OnContact("local s = ('x'):rep(60000) return ('%s%s'):format(s, s)"),
            "game.lua:2: string.format: the text has more than 64 KiB");
  EXPECT_EQ(OnContact("local s = ('x'):rep(60000) return table.concat({ s, s })"),
            "game.lua:2: table.concat: the text has more than 64 KiB");
  EXPECT_EQ(OnContact("local s = ('x'):rep(60000) return s .. s"), "game.lua:2: a text of more than 64 KiB");
  EXPECT_EQ(OnContact("return table.unpack({}, 1, 1e8)"), "game.lua:2: table.unpack: more than 250 values");
  EXPECT_EQ(OnContact("return table.unpack({}, math.mininteger, math.maxinteger)"),
            "game.lua:2: table.unpack: more than 250 values");
  EXPECT_EQ(OnContact("return ('x'):rep(60000):byte(1, -1)"), "game.lua:2: string.byte: more than 250 values");
  EXPECT_EQ(OnContact("table.move({}, 1, 1e15, 2)"), kTooMuchWork);
  EXPECT_EQ(OnContact("table.move({}, math.mininteger, math.maxinteger, 2)"),
            "game.lua:2: table.move: too many values");
  EXPECT_EQ(
      OnContact("table.concat(setmetatable({}, { __len = function() return 1e15 end, __index = function() return '' "
                "end }))"),
      kTooMuchWork);
  EXPECT_EQ(OnContact("table.sort(setmetatable({}, { __len = function() return 1e15 end }))"), kTooMuchWork);
}

TEST_F(LuaModuleTest, HandlesTables) {
  EXPECT_EQ(Value("(function() local t = { 1, 2, 3 } table.insert(t, 4) table.insert(t, 1, 0) table.remove(t, 2)\n"
                  "return table.concat(t, ' '), table.remove(t), #t, table.pack(1, nil).n end)()"),
            "0 2 3 4\t4\t3\t2");
  EXPECT_EQ(Value("table.concat(table.move({ 1, 2, 3 }, 1, 3, 2), ' '), table.unpack({ 1, 2 })"), "1 1 2 3\t1\t2");
  EXPECT_EQ(Value("table.remove({})"), "nil");
  EXPECT_EQ(OnContact("table.insert({}, 3, 1)"), "game.lua:2: table.insert: position 3 is not between 1 and 1");
  EXPECT_EQ(OnContact("table.concat({ {} })"),
            "game.lua:2: table.concat: value 1 is a table; it must be a text or a number");
}

}  // namespace
}  // namespace tessera::game
