// CheckGame finds what is wrong, and leaves alone what is right.
#include "game_sdk/tools/check.h"

#include <gmock/gmock.h>

#include <random>

#include "absl/strings/str_cat.h"
#include "game_sdk/tools/lua_tokens.h"
#include "game_sdk/tools/lua_tree.h"
#include "game_sdk/tools/new_game.h"
#include "lua.hpp"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

std::vector<std::string> Faults(const std::string& source) {
  Scene scene;
  scene.kinds = {"", "crate", "ball"};
  scene.properties = {{"health", std::int64_t{100}}, {"name", std::string("none")}};
  scene.instance_properties = {{"goals", std::int64_t{0}}};
  scene.prefabs.emplace_back().name = "brick";
  std::vector<std::string> texts;
  for (const GameFault& fault : CheckGame({"game.lua", source}, scene)) {
    texts.push_back(absl::StrCat(fault.line, ": ", fault.text));
  }
  return texts;
}

std::vector<std::string> InContact(const std::string& statements) {
  return Faults("kinds.crate = { on_contact = function(self, other)\n" + statements + "\nend }");
}

TEST(CheckTest, PropertiesOfTheWorldAreKnown) {
  EXPECT_THAT(InContact("world.goals = world.goals + 1"), IsEmpty());
  EXPECT_THAT(InContact("print(world.gaols)"),
              ElementsAre("2: there is no `world.gaols`; did you mean `world.goals`?"));
  EXPECT_THAT(InContact("world.gaols = 1"),
              ElementsAre("2: `world.gaols` is written outside of loading; keep state in properties"));
}

TEST(CheckTest, FindsAllFaultsAtOnce) {
  EXPECT_THAT(Faults("local n = 0\n"
                     "function on_tik() n = n + 1 end\n"
                     "kinds.crte = {}\n"
                     "kinds.crate = {\n"
                     "  on_contct = function(self) end,\n"
                     "  on_contact = function(self, other)\n"
                     "    self.helth = 1\n"
                     "    other:impluse(vec(0, 1, 0))\n"
                     "    total = 1\n"
                     "    prnt(world.tik())\n"
                     "  end,\n"
                     "}\n"),
              ElementsAre("2: `n` would be kept between callbacks and lost with a handover; keep it in a property",
                          "2: `on_tik` is no callback of the world; did you mean `on_tick`?",
                          "3: the scene has no bodies of the kind `crte`; did you mean `crate`?",
                          "5: `kinds.crate.on_contct` is no callback of bodies; did you mean `on_contact`?",
                          "7: the scene declares no property `helth`; did you mean `health`?",
                          "8: bodies have no function `impluse`; did you mean `impulse`?",
                          "9: `total` is written outside of loading; keep state in properties",
                          "10: `prnt` is not defined; did you mean `print`?",
                          "10: there is no `world.tik`; did you mean `world.tick`?"));
}

TEST(CheckTest, FindsUndeclaredProperties) {
  EXPECT_THAT(InContact("return self:get('mana')"), ElementsAre("2: the scene declares no property `mana`"));
  EXPECT_THAT(InContact("other:set(\"helt\", 3)"), ElementsAre(HasSubstr("did you mean `health`?")));
  EXPECT_THAT(InContact("local target = other\nreturn target.mana"), ElementsAre(StartsWith("3: ")));
  EXPECT_THAT(InContact("self.health = other.health self:set('name', other:get('name'))"), IsEmpty());
  EXPECT_THAT(InContact("self = { mana = 1 } return self.mana"), IsEmpty()) << "it is no body any more";
  EXPECT_THAT(InContact("local self = {} return self.mana"), IsEmpty());
  EXPECT_THAT(Faults("kinds.ball = {}\nfunction kinds.ball:on_contact(other)\nreturn self.mana end"),
              ElementsAre(StartsWith("3: ")));
}

TEST(CheckTest, FindsPrefabsThatTheSceneDoesNotHave) {
  EXPECT_THAT(InContact("world.spawn('brik', self:position())"),
              ElementsAre("2: the scene has no prefab `brik`; did you mean `brick`?"));
  EXPECT_THAT(InContact("local what = 'brik'\nworld.spawn('brick', self:position()) world.spawn(what, vec(0, 0, 0))"),
              IsEmpty());
  EXPECT_THAT(InContact("local world = { spawn = print } world.spawn('brik')"), IsEmpty()) << "it is another one";
}

TEST(CheckTest, FindsWhatTheWorldWouldSayToNobody) {
  EXPECT_THAT(InContact("world.send('goal')"),
              ElementsAre("2: `world.send` does nothing: the file has no function `on_message`"));
  EXPECT_THAT(InContact("world.after(60, 'restart')"),
              ElementsAre("2: `world.after` does nothing: the file has no function `on_timer`"));
  EXPECT_THAT(Faults("function on_tick() world.send('goal') world.after(60, 'restart') end\n"
                     "function on_message() end\non_timer = on_message"),
              IsEmpty());
}

TEST(CheckTest, FindsFunctionsThatNobodyHas) {
  EXPECT_THAT(InContact("self.impulse(vec(0, 0, 0))"), ElementsAre(HasSubstr("call it as self:impulse(...)")));
  EXPECT_THAT(InContact("self.impulse(self, vec(0, 0, 0))"), IsEmpty());
  EXPECT_THAT(Faults("local function hit(body)\nbody:impluse(vec(0, 1, 0))\nend\nfunction on_tick() hit() end"),
              ElementsAre("2: nothing has a function `impluse`; did you mean `impulse`?"));
  EXPECT_THAT(InContact("local v = self:position():normalized() return ('x'):rep(3), v:length()"), IsEmpty());
  EXPECT_THAT(InContact("return string.fromat('x')"), ElementsAre(HasSubstr("did you mean `string.format`?")));
}

TEST(CheckTest, FindsWritesThatWouldBeLost) {
  EXPECT_THAT(Faults("scores = {}\nfunction on_tick()\nscores.red = 1\nend"),
              ElementsAre("3: `scores.red` is written outside of loading; keep state in properties"));
  EXPECT_THAT(Faults("local list = {}\nfunction on_tick()\nlist[1].x = 1\nend"),
              ElementsAre(StartsWith("3: `list[...].x` is written")));
  EXPECT_THAT(Faults("function on_tick()\nfunction helper() end\nend"), ElementsAre(StartsWith("2: `helper`")));
  EXPECT_THAT(Faults("local a, b = 1, 2\nfunction on_tick()\na, b = b, a\nend"),
              ElementsAre(StartsWith("3: `a`"), StartsWith("3: `b`")));
}

TEST(CheckTest, LeavesAloneWhatIsRight) {
  EXPECT_THAT(Faults("local count = 0\nlocal function note() count = count + 1 total = count end note()\n"
                     "for _, name in ipairs({ 'a' }) do _ = name end\n"
                     "local list = {} table.sort({ 2, 1 }, function(a, b) list[1] = a return a < b end)\n"
                     "function on_tick() local n = 0 local function inc() n = n + 1 end inc() print(n, total) end\n"),
              IsEmpty());
  EXPECT_THAT(Faults("local Point = {} Point.__index = Point\nfunction Point:lenght() return self.mana end\n"
                     "function on_tick() local p = setmetatable({}, Point) p.mana = 1 return p:lenght() end"),
              IsEmpty());
  EXPECT_THAT(Faults("kinds = { crate = { on_tick = function(self) repeat local x = 1 until x == 1 goto done\n"
                     "::done:: end } }"),
              IsEmpty());
  EXPECT_THAT(Faults("local hit = function(self, other) return self.anything end\nkinds.crate = { on_contact = hit }"),
              IsEmpty());
}

TEST(CheckTest, ANewGameHasNoFaults) {
  Scene scene;
  scene.kinds = {"", "gate", "ball"};
  scene.properties = {{"score", std::int64_t{0}}};
  for (const GameFile& file : NewGame("x")) {
    if (file.name != "game.lua") continue;
    EXPECT_THAT(CheckGame(file, scene), IsEmpty());
  }
}

TEST(CheckTest, WhatDoesNotLoadIsOneFault) {
  EXPECT_THAT(Faults("local x = = 1"), ElementsAre("1: unexpected symbol near '='"));
  EXPECT_THAT(Faults("\n\x1bLua"), ElementsAre(HasSubstr("unexpected symbol")));
  EXPECT_THAT(Faults("while true do end"), ElementsAre("1: too much work"));
  EXPECT_THAT(Faults(std::string((1 << 20) + 1, ' ')), ElementsAre("0: the file has more than 1 MiB"));
  EXPECT_THAT(Faults("error('no')\nmissing()"), ElementsAre("1: no", "2: `missing` is not defined"));
}

TEST(CheckTest, LongChainsAreRefusedAndNotFollowed) {
  std::string chain = "local t = {} t.t = t\nreturn t";
  for (int i = 0; i < 100'000; ++i) chain += ".t";
  EXPECT_THAT(Faults(chain), ElementsAre("0: line 2: cannot be looked through"));
}

constexpr char kAllOfTheGrammar[] = R"(-- a comment
local a <const>, b <close> = 0x1p-4, 1e+3
local long, quoted = [==[ ] ]] ]==], 'a\'b' --[[ comment
over lines ]] .. "x\
y"
for i = 1, 3, -1 do goto continue ::continue:: end
for k, v in next, {} do break end
while not a do end
if a then elseif b then else end
repeat local z = 3 until z > 2 or z << 1 >> 2 ~= ~z
local t = { 1, [2] = 3; x = 4, f = function(...) return ... end, }
t.f 'text' t.f [[long]] t.f { 1 } ;(t.f)(2)
function t.a() end
function t.b.c:d(e) return self, e end
return t.x.y[1]:z(1, 2)(3)[4], -a ^ 2 % 3 .. 'c' // #long, nil == true)";

TEST(CheckTest, ReadsAllOfTheGrammar) {
  const auto tree = ParseLua(kAllOfTheGrammar);
  ASSERT_TRUE(tree.ok()) << tree.status();
  EXPECT_EQ((*tree)->children.back()->line, 15);
  EXPECT_EQ(LuaTokens(kAllOfTheGrammar).back().line, 15);
  // No prefix of it is read beyond its end, though most of them are no Lua.
  const std::string_view source = kAllOfTheGrammar;
  std::size_t read = 0;
  for (std::size_t bytes = 0; bytes < source.size(); ++bytes) {
    const std::string part(source.substr(0, bytes));
    if (ParseLua(part).ok()) ++read;
  }
  EXPECT_GT(read, 0U);
  EXPECT_LT(read, source.size() / 2);
}

// Sources whose tokens are mixed up by chance are given to Lua's own compiler and to ours.
TEST(CheckTest, WhatLuaCompilesIsLookedThrough) {
  std::mt19937 random(1);
  std::vector<std::string> tokens;
  for (const LuaToken& token : LuaTokens(kAllOfTheGrammar)) {
    tokens.push_back(token.kind == LuaTokenKind::kText ? "'text'" : std::string(token.text));
  }
  lua_State* const L = luaL_newstate();
  int compiled = 0;
  for (int i = 0; i < 20'000; ++i) {
    // A few neighbouring tokens, one of them changed: short sources often compile.
    const std::size_t first = random() % tokens.size(), count = 1 + random() % 24;
    std::string source;
    for (std::size_t at = first; at < std::min(first + count, tokens.size()); ++at) {
      source += (random() % 16 == 0 ? tokens[random() % tokens.size()] : tokens[at]) + " ";
    }
    const bool compiles = luaL_loadbufferx(L, source.data(), source.size(), "=", "t") == LUA_OK;
    lua_settop(L, 0);
    const auto tree = ParseLua(source);
    if (!compiles) continue;
    ++compiled;
    ASSERT_TRUE(tree.ok()) << source;
  }
  lua_close(L);
  EXPECT_GT(compiled, 500);
}

}  // namespace
}  // namespace tessera::game
