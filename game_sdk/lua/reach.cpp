#include "game_sdk/lua/reach.h"

#include <cctype>
#include <string_view>

#include "game_sdk/lua/limits.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/sorted_keys.h"

namespace tessera::game {
namespace {

// Stack positions while things are listed.
struct Walk {
  int found, seen;
  lua_Integer count = 0;
};

// Appends the object below the path on top, if it is a table or function that is new. Pops both.
void Add(lua_State* L, Walk& walk) {
  const int object = lua_gettop(L) - 1;
  if (lua_isuserdata(L, object) != 0 && UserTypeOf(L, object) == kUserLoop) {
    Raise(L, "`%s` keeps the state of a loop", lua_tostring(L, -1));
  }
  if (lua_istable(L, object) || (lua_isfunction(L, object) && lua_iscfunction(L, object) == 0)) {
    lua_pushvalue(L, object);
    if (lua_rawget(L, walk.seen) == LUA_TNIL) {
      lua_pushvalue(L, object);
      lua_pushboolean(L, 1);
      lua_rawset(L, walk.seen);
      lua_pushvalue(L, object);
      lua_rawseti(L, walk.found, ++walk.count);
      lua_pushvalue(L, object + 1);
      lua_rawseti(L, walk.found, ++walk.count);
    }
  }
  lua_settop(L, object - 1);
}

// Adds key and value of the table's entry on top; pops the value.
void AddEntry(lua_State* L, Walk& walk, int path) {
  const int key = lua_gettop(L) - 1;
  PushPath(L, path, key);
  Add(L, walk);
  lua_pushvalue(L, key);
  lua_pushvalue(L, path);
  Add(L, walk);
}

void AddTable(lua_State* L, Walk& walk, int table, int path) {
  PushSortedKeys(L, table, OtherKeys::kSkip);
  const int keys = lua_gettop(L);
  const lua_Integer count = static_cast<lua_Integer>(lua_rawlen(L, keys));
  for (lua_Integer i = 1; i <= count; ++i) {
    lua_rawgeti(L, keys, i);
    lua_pushvalue(L, -1);
    lua_rawget(L, table);
    AddEntry(L, walk, path);
    lua_settop(L, keys);
  }
  // Once more for the keys without an order.
  for (lua_pushnil(L); lua_next(L, table) != 0;) AddEntry(L, walk, path);
  if (lua_getmetatable(L, table) != 0) {
    lua_pushfstring(L, "getmetatable(%s)", lua_tostring(L, path));
    Add(L, walk);
  }
  lua_settop(L, keys - 1);
}

void AddUpvalues(lua_State* L, Walk& walk, int function) {
  for (int i = 1; const char* const name = lua_getupvalue(L, function, i); ++i) {
    lua_pushstring(L, name);
    Add(L, walk);
  }
}

bool IsName(std::string_view text) {
  if (text.empty() || std::isdigit(static_cast<unsigned char>(text[0])) != 0) return false;
  for (const char letter : text) {
    if (std::isalnum(static_cast<unsigned char>(letter)) == 0 && letter != '_') return false;
  }
  return true;
}

}  // namespace

void Reach(lua_State* L, int globals, int callbacks) {
  luaL_checkstack(L, 20, nullptr);
  globals = lua_absindex(L, globals);
  lua_newtable(L);
  lua_newtable(L);
  Walk walk{lua_gettop(L) - 1, lua_gettop(L)};
  lua_pushvalue(L, globals);
  lua_pushliteral(L, "");
  Add(L, walk);
  const lua_Integer functions = static_cast<lua_Integer>(lua_rawlen(L, callbacks));
  for (lua_Integer i = 1; i <= functions; ++i) {
    lua_rawgeti(L, callbacks, i);
    lua_pushliteral(L, "kinds");
    Add(L, walk);
  }
  for (lua_Integer i = 1; i <= walk.count; i += kReachedStride) {
    lua_rawgeti(L, walk.found, i + kReachedObject);
    lua_rawgeti(L, walk.found, i + kReachedPath);
    const int object = lua_gettop(L) - 1;
    if (lua_istable(L, object)) {
      AddTable(L, walk, object, object + 1);
    } else {
      AddUpvalues(L, walk, object);
    }
    lua_settop(L, walk.seen);
  }
  lua_settop(L, walk.found);
}

void PushPath(lua_State* L, int path, int key) {
  std::size_t path_bytes = 0;
  const char* const prefix = lua_tolstring(L, path, &path_bytes);
  if (path_bytes > kMaxPathBytes) {
    lua_pushvalue(L, path);
  } else if (lua_type(L, key) == LUA_TSTRING) {
    std::size_t bytes = 0;
    const char* const name = lua_tolstring(L, key, &bytes);
    if (bytes > kMaxPathBytes) {
      lua_pushfstring(L, "%s[...]", prefix);
    } else if (!IsName({name, bytes})) {
      lua_pushfstring(L, "%s[\"%s\"]", prefix, name);
    } else if (path_bytes == 0) {
      lua_pushvalue(L, key);
    } else {
      lua_pushfstring(L, "%s.%s", prefix, name);
    }
  } else if (lua_isinteger(L, key) != 0) {
    lua_pushfstring(L, "%s[%I]", prefix, lua_tointeger(L, key));
  } else {
    lua_pushfstring(L, "%s[...]", prefix);
  }
}

}  // namespace tessera::game
