#include "game_sdk/lua/sandbox.h"

#include <algorithm>
#include <string_view>

#include "game_sdk/lua/bindings.h"
#include "game_sdk/lua/freeze.h"
#include "game_sdk/lua/handles.h"
#include "game_sdk/lua/limits.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/sorted_keys.h"
#include "game_sdk/lua/spelling.h"
#include "game_sdk/lua/tables.h"
#include "game_sdk/lua/texts.h"
#include "game_sdk/lua/values.h"
#include "game_sdk/lua/vectors.h"

namespace tessera::game {
namespace {

// Work of making an error and unwinding the stack, in instructions.
constexpr std::uint64_t kErrorWork = 50;

int UndefinedName(lua_State* L) {
  if (lua_type(L, 2) != LUA_TSTRING) Raise(L, "a global name that is %s is not defined", ValueName(L, 2));
  const char* const name = lua_tostring(L, 2);
  Suggestion suggestion(name);
  const bool suggest = Runtime::Of(L).TakeSuggestion();
  for (lua_pushnil(L); suggest && lua_next(L, 1) != 0; lua_pop(L, 1)) {
    if (lua_type(L, -2) == LUA_TSTRING) suggestion.Offer(lua_tostring(L, -2));
  }
  if (suggestion.best().empty()) Raise(L, "`%.60s` is not defined", name);
  Raise(L, "`%.60s` is not defined; did you mean `%.60s`?", name, suggestion.best().data());
}

// pcall, which passes on that the call has ended: else a loop of pcall would run for ever.
int ProtectedCall(lua_State* L) {
  luaL_checkany(L, 1);
  const int status = lua_pcall(L, lua_gettop(L) - 1, LUA_MULTRET, 0);
  if (Runtime::Of(L).ended()) RaiseEnd(L);
  if (status != LUA_OK) Charge(L, kErrorWork);
  lua_pushboolean(L, status == LUA_OK);
  lua_insert(L, 1);
  return lua_gettop(L);
}

int Type(lua_State* L) {
  luaL_checkany(L, 1);
  lua_pushstring(L, ValueType(L, 1));
  return 1;
}

int TostringFunction(lua_State* L) {
  luaL_checkany(L, 1);
  PushText(L, 1, nullptr);
  return 1;
}

int RawGet(lua_State* L) {
  luaL_checktype(L, 1, LUA_TTABLE);
  luaL_checkany(L, 2);
  lua_settop(L, 2);
  PushContents(L, 1);
  lua_insert(L, 2);
  lua_rawget(L, 2);
  return 1;
}

int RawLength(lua_State* L) {
  luaL_argexpected(L, lua_istable(L, 1) || lua_type(L, 1) == LUA_TSTRING, 1, "table or string");
  if (lua_istable(L, 1)) PushContents(L, 1);
  lua_pushinteger(L, static_cast<lua_Integer>(lua_rawlen(L, -1)));
  return 1;
}

// Bytes of `text` that a line takes: at most `limit`, and no part of a character.
std::size_t CutAt(const char* text, std::size_t bytes, std::size_t limit) {
  if (bytes <= limit) return bytes;
  std::size_t cut = limit;
  while (cut > 0 && limit - cut < 3 && (static_cast<unsigned char>(text[cut]) & 0xc0) == 0x80) --cut;
  return cut;
}

int Print(lua_State* L) {
  if (Runtime::Of(L).call() == nullptr) Raise(L, "print: there is no world while the file is loaded");
  const int count = lua_gettop(L);
  luaL_Buffer buffer;
  luaL_buffinit(L, &buffer);
  for (int i = 1; i <= count && luaL_bufflen(&buffer) <= kMaxPrintBytes; ++i) {
    if (i > 1) luaL_addchar(&buffer, '\t');
    std::size_t bytes = 0;
    const char* const text = PushText(L, i, &bytes);
    lua_replace(L, i);
    luaL_addlstring(&buffer, text, std::min(bytes, kMaxPrintBytes + 1));
  }
  luaL_pushresult(&buffer);
  tessera_game_value line, result;
  std::size_t bytes = 0;
  line.type = TESSERA_GAME_TEXT;
  line.as.text = lua_tolstring(L, -1, &bytes);
  line.count = static_cast<std::uint32_t>(CutAt(line.as.text, bytes, kMaxPrintBytes));
  CallHost(L, *FindFunction(kWorldLog), &line, 1, result);
  return 0;
}

// random(): from 0 to below 1. random(n): whole, 1 to n. random(m, n): whole, m to n.
int Random(lua_State* L) {
  if (Runtime::Of(L).call() == nullptr) Raise(L, "random: there is no world while the file is loaded");
  const int given = lua_gettop(L);
  if (given > 2) Raise(L, "random: takes at most 2 arguments, got %d", given);
  const lua_Integer low = given == 2 ? luaL_checkinteger(L, 1) : 1;
  const lua_Integer high = given == 0 ? 1 : luaL_checkinteger(L, given);
  if (low > high) {
    Raise(L, "random: there is no whole number from %lld to %lld", static_cast<long long>(low),
          static_cast<long long>(high));
  }
  // A real number from 0 to 1 has 53 bits.
  const lua_Unsigned range = static_cast<lua_Unsigned>(high) - static_cast<lua_Unsigned>(low);
  if (range >= lua_Unsigned{1} << 53) Raise(L, "random: more than 2^53 numbers");
  tessera_game_value result;
  CallHost(L, *FindFunction(kWorldRandom), nullptr, 0, result);
  if (given == 0) {
    lua_pushnumber(L, result.as.real);
  } else {
    const auto steps = static_cast<lua_Unsigned>(result.as.real * (static_cast<double>(range) + 1));
    lua_pushinteger(L, low + static_cast<lua_Integer>(std::min(steps, range)));
  }
  return 1;
}

// Copies fields of the table on top to the one below.
template <std::size_t kCount>
void Copy(lua_State* L, const char* const (&names)[kCount]) {
  for (const char* const name : names) {
    lua_getfield(L, -1, name);
    lua_setfield(L, -3, name);
  }
}

void AddMath(lua_State* L, int globals) {
  constexpr const char* kNames[] = {"abs",  "acos", "asin", "atan", "ceil",       "cos",  "exp",        "floor",
                                    "fmod", "huge", "log",  "max",  "maxinteger", "min",  "mininteger", "modf",
                                    "pi",   "sin",  "sqrt", "tan",  "tointeger",  "type", "ult"};
  lua_newtable(L);
  luaopen_math(L);
  Copy(L, kNames);
  lua_pop(L, 1);
  lua_pushcfunction(L, Random);
  lua_setfield(L, -2, "random");
  lua_setfield(L, globals, "math");
}

void AddUtf8(lua_State* L, int globals) {
  lua_newtable(L);
  luaopen_utf8(L);
  constexpr const char* kNames[] = {"char", "charpattern"};
  Copy(L, kNames);
  for (const char* const name : {"codes", "len", "offset"}) {
    lua_getfield(L, -1, name);
    ChargeFirstArgument(L);
    lua_setfield(L, -3, name);
  }
  lua_pop(L, 1);
  lua_setfield(L, globals, "utf8");
}

void AddTexts(lua_State* L, int globals) {
  luaopen_string(L);
  PushTextLibrary(L);
  // ("text"):upper() finds the functions by the metatable of texts, of which luaopen_string made one of its own.
  lua_pushliteral(L, "");
  lua_createtable(L, 0, 2);
  lua_pushvalue(L, -3);
  lua_setfield(L, -2, "__index");
  lua_pushboolean(L, 0);
  lua_setfield(L, -2, "__metatable");
  lua_setmetatable(L, -2);
  lua_pop(L, 1);
  lua_setfield(L, globals, "string");
}

void AddBasics(lua_State* L, int globals) {
  // luaopen_base fills whatever the registry has as globals.
  lua_newtable(L);
  lua_rawseti(L, LUA_REGISTRYINDEX, LUA_RIDX_GLOBALS);
  luaopen_base(L);
  constexpr const char* kNames[] = {"assert", "error", "ipairs", "rawequal", "select"};
  lua_pushvalue(L, globals);
  lua_insert(L, -2);
  Copy(L, kNames);
  lua_getfield(L, -1, "tonumber");
  ChargeFirstArgument(L);
  lua_setfield(L, globals, "tonumber");
  lua_settop(L, globals);
  constexpr luaL_Reg kFunctions[] = {{"getmetatable", GetMetatable},
                                     {"next", Next},
                                     {"pairs", Pairs},
                                     {"pcall", ProtectedCall},
                                     {"print", Print},
                                     {"rawget", RawGet},
                                     {"rawlen", RawLength},
                                     {"setmetatable", SetMetatable},
                                     {"tostring", TostringFunction},
                                     {"type", Type},
                                     {"vec", NewVector},
                                     {nullptr, nullptr}};
  luaL_setfuncs(L, kFunctions, 0);
}

void AddMetatables(lua_State* L) {
  Runtime& runtime = Runtime::Of(L);
  for (int type = 0; type < kUserTypes; ++type) {
    lua_newtable(L);
    lua_pushboolean(L, 0);
    lua_setfield(L, -2, "__metatable");
    lua_pushvalue(L, -1);
    runtime.metatable_references[type] = luaL_ref(L, LUA_REGISTRYINDEX);
    switch (static_cast<UserType>(type)) {
      case kUserVector:
        SetUpVectors(L);
        break;
      case kUserRotation:
        SetUpRotations(L);
        break;
      case kUserBody:
        SetUpHandles(L, kUserBody);
        SetUpBodyFields(L);
        break;
      case kUserPlayer:
        SetUpHandles(L, kUserPlayer);
        SetUpPlayerFields(L);
        break;
      default:
        SetUpLoops(L);
        break;
    }
    lua_pop(L, 1);
  }
}

}  // namespace

int SetUpState(lua_State* L) {
  AddMetatables(L);
  lua_settop(L, 0);
  lua_newtable(L);
  AddBasics(L, 1);
  AddMath(L, 1);
  AddUtf8(L, 1);
  AddTexts(L, 1);
  PushTableLibrary(L);
  lua_setfield(L, 1, "table");
  PushWorld(L);
  lua_setfield(L, 1, "world");
  lua_newtable(L);
  lua_setfield(L, 1, "kinds");
  RequireDefinedNames(L);
  lua_rawseti(L, LUA_REGISTRYINDEX, LUA_RIDX_GLOBALS);
  return 0;
}

void RequireDefinedNames(lua_State* L) {
  lua_createtable(L, 0, 2);
  lua_pushcfunction(L, UndefinedName);
  lua_setfield(L, -2, "__index");
  lua_pushboolean(L, 0);
  lua_setfield(L, -2, "__metatable");
  lua_setmetatable(L, -2);
}

}  // namespace tessera::game
