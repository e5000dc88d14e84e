// The limits of a callback, and the errors of one that exceeds them or fails.
#include <gmock/gmock.h>

#include <string>

#include "game_sdk/lua/testing/lua_module_fixture.h"
#include "lua.hpp"

namespace tessera::game {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// --- Limits

TEST_F(LuaModuleTest, EndsEndlessLoops) {
  host_.budget = 20'000;
  EXPECT_EQ(OnContact("while true do end"), kTooMuchWork);
  EXPECT_EQ(OnContact("while true do pcall(function() while true do end end) end"), kTooMuchWork);
  EXPECT_EQ(OnContact("local function f() pcall(f) while true do end end f()"), kTooMuchWork);
  EXPECT_EQ(OnContact("while true do pcall(error, {}) end"), kTooMuchWork);
  EXPECT_EQ(OnContact("local s = ('x'):rep(60000) while true do s:upper() end"), kTooMuchWork);
  EXPECT_EQ(OnContact("local t <close> = setmetatable({}, { __close = function() while true do end end })\n"
                      "while true do end"),
            "game.lua:3: too much work");
  EXPECT_EQ(OnContact("table.sort({ 1, 2 }, function() while true do end end)"), kTooMuchWork);
  EXPECT_EQ(OnContact("tostring(setmetatable({}, { __tostring = function() while true do end end }))"), kTooMuchWork);
  EXPECT_EQ(OnContact("error(setmetatable({}, { __tostring = function() while true do end end }))"), kTooMuchWork);
  EXPECT_EQ(OnContact("goto x ::x:: goto x"), kTooMuchWork);
  EXPECT_EQ(OnContact("for i = 1, 20 do ('%99.99f'):format(1e308) end"), kTooMuchWork);
}

TEST_F(LuaModuleTest, CountsWorkAnewForEachCallback) {
  ASSERT_EQ(Load("function on_tick() for i = 1, 2345 do end end"), "");
  ASSERT_EQ(Tick(), "");
  const std::uint64_t first = host_.work;
  EXPECT_EQ(first, 2000u);
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(Tick(), "");
    EXPECT_EQ(host_.work, first);
  }
}

TEST_F(LuaModuleTest, BoundsTheWorkOfLoading) {
  EXPECT_EQ(Load("local n = 0\nwhile true do n = n + 1 end"), "game.lua:2: too much work");
  EXPECT_EQ(Load("while true do pcall(function() while true do end end) end"), "game.lua:1: too much work");
  EXPECT_EQ(Load("local t = {} while true do t[#t + 1] = {} end"), "game.lua:1: too much memory");
}

TEST_F(LuaModuleTest, BoundsMemory) {
  host_.budget = 1'000'000'000;
  ASSERT_EQ(Load("kinds.crate = { on_contact = function()\nlocal t = {} for i = 1, 1e7 do t[i] = {} end\nend }\n"
                 "function on_tick() world.log('alive') end"),
            "");
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(Contact(), "game.lua:2: too much memory");
    EXPECT_EQ(Tick(), "");
  }
  EXPECT_EQ(host_.lines.size(), 20u);
  EXPECT_EQ(OnContact("local t = {} for i = 1, 1e7 do t[i] = ('x'):rep(60000) .. i end"),
            "game.lua:2: too much memory");
  EXPECT_EQ(OnContact("while true do pcall(function() local t = {} for i = 1, 1e7 do t[i] = {} end end) end"),
            "game.lua:2: too much memory");
  EXPECT_EQ(OnContact("local s = 'x' while true do s = s .. s end"), "game.lua:2: a text of more than 64 KiB");
  // Freed memory is not given back.
  EXPECT_EQ(OnContact("while true do local t = { 1 } for i = 2, 1000 do t[i] = i end end"),
            "game.lua:2: too much memory");
}

TEST_F(LuaModuleTest, EndsDeepRecursion) {
  constexpr char kDeep[] = "calls are nested too deeply, or have too many arguments";
  EXPECT_THAT(OnContact("local function f() return 1 + f() end f()"), EndsWith(kDeep));
  EXPECT_THAT(OnContact("local function f(...) return f(1, ...) end f()"), EndsWith(kDeep));
  EXPECT_EQ(OnContact("local function f(n) if n > 0 then return 1 + f(n - 1) end return 0 end assert(f(900) == 900)"),
            "");
  for (const char* const statement : {
           "local function f() local ok, why = pcall(f) error(why, 0) end f()",
           "local function f() table.sort({ 2, 1 }, f) end f()",
           "local t = setmetatable({}, {}) getmetatable(t).__index = function(t, k) return t[k + 1] end return t[1]",
           "local t = setmetatable({}, {}) getmetatable(t).__tostring = function() return 'x' .. tostring(t) end "
           "tostring(t)",
           "local t = setmetatable({}, {}) getmetatable(t).__concat = function() return t .. t end return t .. t",
           "local t = setmetatable({}, {}) getmetatable(t).__eq = function(a, b) return a == b end\n"
           "return t == setmetatable({}, getmetatable(t))",
           "local t = setmetatable({}, {}) getmetatable(t).__len = function(a) return #a end return #t",
           "local t = setmetatable({}, {}) getmetatable(t).__pairs = pairs return pairs(t)",
       }) {
    EXPECT_THAT(OnContact(statement), HasSubstr("C stack overflow")) << statement;
    EXPECT_THAT(Contact(), StartsWith("game.lua:")) << statement;
  }
  // A loop of __index or a chain of __call is an error of its own.
  EXPECT_THAT(OnContact("local t = {} setmetatable(t, { __index = t }) return t.x"), StartsWith("game.lua:2: "));
  EXPECT_NE(Load("local a = " + std::string(500, '(') + "1" + std::string(500, ')')), "");
  EXPECT_NE(Load(std::string(500, '{')), "");
}

// --- Errors

TEST_F(LuaModuleTest, MakesOneLineOfAnyError) {
  EXPECT_EQ(OnContact("error('no')"), "game.lua:2: no");
  EXPECT_EQ(OnContact("error('no', 0)"), "game.lua:2: no");
  EXPECT_EQ(OnContact("error('a\\nb\\0c\\27', 0)"), "game.lua:2: a b?c?");
  EXPECT_EQ(OnContact("error({})"), "game.lua:2: an error that is a table");
  EXPECT_EQ(OnContact("error()"), "game.lua:2: an error that is nothing");
  EXPECT_EQ(OnContact("error(7)"), "game.lua:2: an error that is a whole number");
  EXPECT_EQ(OnContact("error(setmetatable({}, { __tostring = function() return 'mine' end }))"), "game.lua:2: mine");
  EXPECT_EQ(OnContact("error(setmetatable({}, { __tostring = function() error('inner') end }))"),
            "game.lua:2: an error that is a table");
  EXPECT_EQ(OnContact("error(setmetatable({}, { __tostring = 3 }))"), "game.lua:2: an error that is a table");
  EXPECT_EQ(OnContact("error('')"), "game.lua:2: ");
  EXPECT_EQ(OnContact("assert(false)"), "game.lua:2: assertion failed!");
  EXPECT_EQ(OnContact("local t\nt.x = 1"), "game.lua:3: attempt to index a nil value (local 't')");
  EXPECT_EQ(OnContact("pcall(error, 'x') error('y')"), "game.lua:2: y");
  const std::string cut = OnContact("error(('\\u{e4}'):rep(1000))");
  EXPECT_LT(cut.size(), sizeof(tessera_game_error::text));
  EXPECT_GT(cut.size(), 500u);
  EXPECT_EQ(static_cast<unsigned char>(cut.back()), 0xa4);
}

TEST_F(LuaModuleTest, RunsOnAfterErrors) {
  ASSERT_EQ(
      Load("kinds.crate = { on_contact = function() error('no') end }\nfunction on_tick() world.log('alive') end"), "");
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(Contact(), "game.lua:1: no");
    ASSERT_EQ(Tick(), "");
  }
  EXPECT_EQ(host_.lines.size(), 1000u);
}

TEST_F(LuaModuleTest, FailsInEachHandler) {
  std::string source = "function on_tick() error('tick') end\nkinds.crate = {";
  for (const Callback& callback : Callbacks()) {
    if (callback.receiver == Receiver::kBody) source += std::string(callback.name) + " = function() error('no') end,\n";
  }
  ASSERT_EQ(Load(source + "}"), "");
  EXPECT_EQ(Tick(), "game.lua:1: tick");
  for (const Callback& callback : Callbacks()) {
    if (callback.receiver != Receiver::kBody) continue;
    EXPECT_THAT(Run(callback.number, "crate", {Body(2)}), EndsWith(": no")) << callback.name;
  }
}

TEST_F(LuaModuleTest, RefusesBadSources) {
  EXPECT_EQ(Load("local a = 1\nlocal b = = 2"), "game.lua:2: unexpected symbol near '='");
  EXPECT_EQ(Load("\x1bLua"), "game.lua: attempt to load a binary chunk (mode is 't')");
  EXPECT_EQ(Load(std::string((1 << 20) + 1, ' ')), "game.lua: the file has more than 1 MiB");
  EXPECT_EQ(Load(std::string(1 << 20, ' ')), "");
  EXPECT_EQ(Load(std::string("local a\0 = 1", 12)), "game.lua:1: unexpected symbol");
  EXPECT_EQ(Load("error({})"), "game.lua:1: an error that is a table");
  EXPECT_EQ(Load("local a = '" + std::string(70000, 'x') + "'"), "game.lua: a text of more than 64 KiB");
}

// The work of a callback does not change what the next one may do.
TEST_F(LuaModuleTest, BeginsEachCallbackAlike) {
  ASSERT_EQ(Load("local function deep(n) if n > 0 then return 1 + deep(n - 1) end return 0 end\n"
                 "function on_tick() print(deep(900)) end\nkinds.crate = { on_contact = function() deep(1e9) end }"),
            "");
  std::uint64_t work = 0;
  for (int i = 0; i < 50; ++i) {
    EXPECT_THAT(Contact(), StartsWith("game.lua:1: calls are nested too deeply"));
    if (i == 0) work = host_.work;
    EXPECT_EQ(host_.work, work);
    EXPECT_EQ(Tick(), "");
  }
  EXPECT_EQ(host_.lines.size(), 50u);
}

// A real chunk of Lua's own, not only its first bytes.
TEST_F(LuaModuleTest, RefusesCompiledSources) {
  lua_State* const L = luaL_newstate();
  ASSERT_EQ(luaL_loadstring(L, "function on_tick() end"), LUA_OK);
  std::string bytes;
  lua_dump(
      L,
      [](lua_State*, const void* data, std::size_t count, void* to) {
        static_cast<std::string*>(to)->append(static_cast<const char*>(data), count);
        return 0;
      },
      &bytes, 0);
  lua_close(L);
  EXPECT_EQ(Load(bytes), "game.lua: attempt to load a binary chunk (mode is 't')");
}

TEST_F(LuaModuleTest, NamesUndefinedGlobals) {
  EXPECT_EQ(Load("function health() end\nfunction on_tick()\nreturn helth end"), "");
  EXPECT_EQ(Tick(), "game.lua:3: `helth` is not defined; did you mean `health`?");
  EXPECT_EQ(OnContact("return zzz"), "game.lua:2: `zzz` is not defined");
  EXPECT_EQ(Load("\nkind.crate = {}"), "game.lua:2: `kind` is not defined; did you mean `kinds`?");
}

}  // namespace
}  // namespace tessera::game
