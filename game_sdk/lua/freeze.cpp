#include "game_sdk/lua/freeze.h"

#include <cstring>
#include <initializer_list>

#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/reach.h"
#include "game_sdk/lua/sorted_keys.h"

namespace tessera::game {
namespace {

// Keys of the metatable of a frozen table, and of the registry. Lua code cannot make such keys.
const char kBackingKey = 'b', kOriginalKey = 'o', kPathKey = 'p', kKeysKey = 'k';
const char kFacadesKey = 'f';  // registry: from the backing to its frozen table

// Pushes a field of the metatable of a frozen table. Returns false, and pushes nothing, if it is not frozen.
bool PushFrozenField(lua_State* L, int index, const char& key) {
  if (lua_getmetatable(L, index) == 0) return false;
  if (lua_rawgetp(L, -1, &kBackingKey) != LUA_TTABLE) {
    lua_pop(L, 2);
    return false;
  }
  lua_pop(L, 1);
  lua_rawgetp(L, -1, &key);
  lua_remove(L, -2);
  return true;
}

int FrozenWrite(lua_State* L) { RaiseFrozen(L, 1, 2); }

int FrozenLength(lua_State* L) {
  PushContents(L, 1);
  lua_pushinteger(L, static_cast<lua_Integer>(lua_rawlen(L, -1)));
  return 1;
}

// __index where the table's own metatable had a function: upvalues are the backing and that function.
int FrozenIndex(lua_State* L) {
  lua_pushvalue(L, 2);
  if (lua_rawget(L, lua_upvalueindex(1)) != LUA_TNIL) return 1;
  lua_pushvalue(L, lua_upvalueindex(2));
  lua_pushvalue(L, 1);
  lua_pushvalue(L, 2);
  lua_call(L, 2, 1);
  return 1;
}

// Moves the contents of the table at `table` into a new one, and pushes that and the list of its keys, or nil if some
// of them have no order. The keys are set in their order, so that a table with gaps has the same length in each run.
void PushBacking(lua_State* L, int table) {
  lua_createtable(L, static_cast<int>(lua_rawlen(L, table)), 0);
  const int backing = lua_gettop(L);
  PushSortedKeys(L, table, OtherKeys::kSkip);
  const lua_Integer count = static_cast<lua_Integer>(lua_rawlen(L, -1));
  for (lua_Integer i = 1; i <= count; ++i) {
    lua_rawgeti(L, backing + 1, i);
    lua_pushvalue(L, -1);
    lua_pushvalue(L, -1);
    lua_rawget(L, table);
    lua_rawset(L, backing);
    lua_pushnil(L);
    lua_rawset(L, table);
  }
  // Keys without an order are left.
  bool ordered = true;
  for (lua_pushnil(L); lua_next(L, table) != 0; ordered = false) {
    lua_pushvalue(L, -2);
    lua_insert(L, -2);
    lua_rawset(L, backing);
    lua_pushvalue(L, -1);
    lua_pushnil(L);
    lua_rawset(L, table);
  }
  if (ordered) return;
  lua_pop(L, 1);
  lua_pushnil(L);
}

// Copies the metamethods in the metatable at `from` into the one on top.
void CopyMetamethods(lua_State* L, int from) {
  const int to = lua_gettop(L);
  lua_pushnil(L);
  while (lua_next(L, from) != 0) {
    const char* const name = lua_type(L, -2) == LUA_TSTRING ? lua_tostring(L, -2) : "";
    if (std::strcmp(name, "__mode") == 0) Raise(L, "weak tables (__mode) are not supported");
    if (std::strcmp(name, "__gc") == 0) Raise(L, "finalizers (__gc) are not supported");
    if (std::strncmp(name, "__", 2) == 0) {
      lua_pushvalue(L, -2);
      lua_insert(L, -2);
      lua_rawset(L, to);
    } else {
      lua_pop(L, 1);
    }
  }
}

// Sets __index of the metatable on top: first the backing, then what the table's own metatable had there.
void SetIndex(lua_State* L, int backing) {
  const int metatable = lua_gettop(L);
  lua_pushliteral(L, "__index");
  switch (lua_rawget(L, metatable)) {
    case LUA_TNIL:
      lua_pop(L, 1);
      lua_pushvalue(L, backing);
      break;
    case LUA_TFUNCTION:
      lua_pushvalue(L, backing);
      lua_insert(L, -2);
      lua_pushcclosure(L, FrozenIndex, 2);
      break;
    default:
      lua_createtable(L, 0, 1);
      lua_insert(L, -2);
      lua_setfield(L, -2, "__index");
      lua_setmetatable(L, backing);
      lua_pushvalue(L, backing);
      break;
  }
  lua_setfield(L, metatable, "__index");
}

// Freezes the table at `table`, which was found by the path on top; pops the path.
void Freeze(lua_State* L, int table) {
  const int path = lua_gettop(L);
  PushBacking(L, table);
  const int backing = path + 1, metatable = path + 3;
  lua_createtable(L, 0, 7);
  if (lua_getmetatable(L, table) != 0) {
    PushContents(L, -1);
    lua_pushvalue(L, metatable);
    CopyMetamethods(L, metatable + 2);
    lua_settop(L, metatable + 1);
    lua_rawsetp(L, metatable, &kOriginalKey);
  }
  SetIndex(L, backing);
  lua_pushcfunction(L, FrozenWrite);
  lua_setfield(L, metatable, "__newindex");
  lua_pushliteral(L, "__len");
  if (lua_rawget(L, metatable) == LUA_TNIL) {
    lua_pushcfunction(L, FrozenLength);
    lua_setfield(L, metatable, "__len");
  }
  lua_settop(L, metatable);
  lua_pushvalue(L, backing);
  lua_rawsetp(L, metatable, &kBackingKey);
  lua_pushvalue(L, path);
  lua_rawsetp(L, metatable, &kPathKey);
  lua_pushvalue(L, backing + 1);
  lua_rawsetp(L, metatable, &kKeysKey);
  lua_setmetatable(L, table);

  lua_rawgetp(L, LUA_REGISTRYINDEX, &kFacadesKey);
  lua_pushvalue(L, backing);
  lua_pushvalue(L, table);
  lua_rawset(L, -3);
  lua_settop(L, path - 1);
}

}  // namespace

void FreezeAll(lua_State* L) {
  const int found = lua_gettop(L);
  luaL_checkstack(L, 30, nullptr);
  lua_newtable(L);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &kFacadesKey);
  const lua_Integer count = static_cast<lua_Integer>(lua_rawlen(L, found));
  for (lua_Integer i = 1; i <= count; i += kReachedStride) {
    if (lua_rawgeti(L, found, i + kReachedObject) == LUA_TTABLE) {
      const int table = lua_gettop(L);
      lua_rawgeti(L, found, i + kReachedPath);
      Freeze(L, table);
    }
    lua_settop(L, found);
  }
}

bool IsFrozen(lua_State* L, int index) {
  if (!PushFrozenField(L, index, kBackingKey)) return false;
  lua_pop(L, 1);
  return true;
}

bool PushFrozenKeys(lua_State* L, int index) {
  if (!PushFrozenField(L, index, kKeysKey)) return false;
  if (lua_istable(L, -1)) return true;
  lua_pop(L, 1);
  return false;
}

void PushContents(lua_State* L, int index) {
  index = lua_absindex(L, index);
  if (!PushFrozenField(L, index, kBackingKey)) lua_pushvalue(L, index);
}

void RaiseFrozen(lua_State* L, int index, int key) {
  PushFrozenField(L, index, kPathKey);
  if (key != 0) PushPath(L, lua_gettop(L), key);
  Raise(L, "`%s` is written outside of loading; keep state in properties", lua_tostring(L, -1));
}

void RequireLive(lua_State* L, int index) {
  if (IsFrozen(L, index)) RaiseFrozen(L, index, 0);
}

int SetMetatable(lua_State* L) {
  luaL_checktype(L, 1, LUA_TTABLE);
  const int type = lua_type(L, 2);
  luaL_argexpected(L, type == LUA_TNIL || type == LUA_TTABLE, 2, "nil or table");
  RequireLive(L, 1);
  if (luaL_getmetafield(L, 1, "__metatable") != LUA_TNIL) Raise(L, "cannot change a protected metatable");
  lua_settop(L, 2);
  if (type == LUA_TTABLE) {
    PushContents(L, 2);
    for (const char* const name : {"__gc", "__mode"}) {
      lua_pushstring(L, name);
      if (lua_rawget(L, 3) != LUA_TNIL) Raise(L, "setmetatable: %s is not supported", name);
      lua_pop(L, 1);
    }
  }
  lua_setmetatable(L, 1);
  lua_settop(L, 1);
  return 1;
}

int GetMetatable(lua_State* L) {
  luaL_checkany(L, 1);
  lua_settop(L, 1);
  if (lua_getmetatable(L, 1) == 0) return 0;
  lua_pushliteral(L, "__metatable");
  if (lua_rawget(L, 2) != LUA_TNIL) return 1;
  if (PushFrozenField(L, 1, kOriginalKey)) return 1;
  lua_settop(L, 2);
  // The metatable may be the backing of a frozen table, which game code must not get hold of.
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, &kFacadesKey) != LUA_TTABLE) {
    lua_settop(L, 2);
    return 1;
  }
  lua_pushvalue(L, 2);
  if (lua_rawget(L, 3) != LUA_TNIL) return 1;
  lua_settop(L, 2);
  return 1;
}

}  // namespace tessera::game
