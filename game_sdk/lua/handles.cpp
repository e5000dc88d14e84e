#include "game_sdk/lua/handles.h"

#include <bit>
#include <cassert>
#include <cinttypes>
#include <cstdio>

namespace tessera::game {
namespace {

int SameHandle(lua_State* L) {
  const UserType type = UserTypeOf(L, 1);
  const bool handles = (type == kUserBody || type == kUserPlayer) && UserTypeOf(L, 2) == type;
  lua_pushboolean(L, handles && static_cast<const Handle*>(lua_touserdata(L, 1))->id ==
                                    static_cast<const Handle*>(lua_touserdata(L, 2))->id);
  return 1;
}

int HandleToText(lua_State* L) {
  char text[40];
  std::snprintf(text, sizeof text, "%s %" PRIu64, UserTypeOf(L, 1) == kUserBody ? "body" : "player",
                static_cast<const Handle*>(lua_touserdata(L, 1))->id);
  lua_pushstring(L, text);
  return 1;
}

// Multiplicative hashing (Knuth, volume 3, 6.4): ids that follow each other come to different places.
std::size_t RecentPlaceOf(std::uint64_t id) {
  constexpr int kBits = std::countr_zero(Runtime::kRecentHandles);
  return static_cast<std::size_t>(id * 0x9e3779b97f4a7c15u >> (64 - kBits));
}

// Pushes the handle that there is, or a new one.
void PushKnownHandle(lua_State* L, UserType type, std::uint64_t id) {
  const Runtime& runtime = Runtime::Of(L);
  const auto key = static_cast<lua_Integer>(id);
  lua_rawgeti(L, LUA_REGISTRYINDEX, runtime.handle_references[type]);
  if (lua_rawgeti(L, -1, key) == LUA_TUSERDATA) return lua_replace(L, -2);
  lua_pop(L, 1);
  static_cast<Handle*>(lua_newuserdatauv(L, kUserBytes[type], 0))->id = id;
  lua_rawgeti(L, LUA_REGISTRYINDEX, runtime.metatable_references[type]);
  lua_setmetatable(L, -2);
  lua_pushvalue(L, -1);
  lua_rawseti(L, -3, key);
  lua_replace(L, -2);
}

// Makes the places of the handles used last: references of the registry that follow each other.
void SetUpRecentHandles(lua_State* L) {
  Runtime& runtime = Runtime::Of(L);
  for (std::size_t i = 0; i < Runtime::kRecentHandles; ++i) {
    lua_pushboolean(L, 0);
    const int reference = luaL_ref(L, LUA_REGISTRYINDEX);
    if (i == 0) runtime.first_recent_reference = reference;
    assert(reference == runtime.first_recent_reference + static_cast<int>(i));
  }
}

}  // namespace

bool PushRecentHandle(lua_State* L, std::uint64_t id) {
  const Runtime& runtime = Runtime::Of(L);
  const std::size_t place = RecentPlaceOf(id);
  if (runtime.recent_ids[place] != id || id == 0) return false;
  lua_rawgeti(L, LUA_REGISTRYINDEX, runtime.first_recent_reference + static_cast<lua_Integer>(place));
  return true;
}

void PushHandle(lua_State* L, UserType type, std::uint64_t id) {
  if (type == kUserBody && PushRecentHandle(L, id)) return;
  PushKnownHandle(L, type, id);
  if (type != kUserBody) return;
  // Allocates nothing: the place is there already.
  Runtime& runtime = Runtime::Of(L);
  const std::size_t place = RecentPlaceOf(id);
  lua_pushvalue(L, -1);
  lua_rawseti(L, LUA_REGISTRYINDEX, runtime.first_recent_reference + static_cast<lua_Integer>(place));
  runtime.recent_ids[place] = id;
}

void SetUpHandles(lua_State* L, UserType type) {
  constexpr luaL_Reg kFunctions[] = {{"__eq", SameHandle}, {"__tostring", HandleToText}, {nullptr, nullptr}};
  luaL_setfuncs(L, kFunctions, 0);
  lua_pushstring(L, type == kUserBody ? "body" : "player");
  lua_setfield(L, -2, "__name");
  // The handles that there are, which the collector forgets when nothing else holds them.
  lua_newtable(L);
  lua_createtable(L, 0, 1);
  lua_pushliteral(L, "v");
  lua_setfield(L, -2, "__mode");
  lua_setmetatable(L, -2);
  Runtime::Of(L).handle_references[type] = luaL_ref(L, LUA_REGISTRYINDEX);
  if (type == kUserBody) SetUpRecentHandles(L);
}

}  // namespace tessera::game
