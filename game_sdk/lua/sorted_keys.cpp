#include "game_sdk/lua/sorted_keys.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "game_sdk/lua/freeze.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/values.h"

namespace tessera::game {
namespace {

// Work for one key, in instructions: it is read, compared some 15 times and written.
constexpr std::uint64_t kKeyWork = 16;

struct Key {
  enum class Kind : std::uint8_t { kWhole, kReal, kText, kFlag } kind;
  lua_Integer whole;  // or flag
  lua_Number real;
  const char* text;  // a string that the table holds
  std::size_t bytes;
};

// A real key is no whole number, as Lua turns such keys into whole ones, but may be beyond all of them.
bool WholeIsLess(lua_Integer whole, lua_Number real) {
  if (real >= 0x1p63) return true;
  if (real < -0x1p63) return false;
  return whole <= static_cast<lua_Integer>(std::floor(real));
}

bool NumberIsLess(const Key& a, const Key& b) {
  const bool whole_a = a.kind == Key::Kind::kWhole, whole_b = b.kind == Key::Kind::kWhole;
  if (whole_a && whole_b) return a.whole < b.whole;
  if (whole_a) return WholeIsLess(a.whole, b.real);
  if (whole_b) return !WholeIsLess(b.whole, a.real);
  return a.real < b.real;
}

bool operator<(const Key& a, const Key& b) {
  const bool number_a = a.kind <= Key::Kind::kReal, number_b = b.kind <= Key::Kind::kReal;
  if (number_a && number_b) return NumberIsLess(a, b);
  if (a.kind != b.kind) return a.kind < b.kind;
  if (a.kind == Key::Kind::kFlag) return a.whole < b.whole;
  return std::string_view(a.text, a.bytes) < std::string_view(b.text, b.bytes);
}

// Reads the key at `index`. Returns false for one without an order.
bool ReadKey(lua_State* L, int index, Key& key) {
  key = {};
  switch (lua_type(L, index)) {
    case LUA_TNUMBER:
      key.kind = lua_isinteger(L, index) != 0 ? Key::Kind::kWhole : Key::Kind::kReal;
      if (key.kind == Key::Kind::kWhole) {
        key.whole = lua_tointeger(L, index);
      } else {
        key.real = lua_tonumber(L, index);
      }
      return true;
    case LUA_TSTRING:
      key.kind = Key::Kind::kText;
      key.text = lua_tolstring(L, index, &key.bytes);
      return true;
    case LUA_TBOOLEAN:
      key.kind = Key::Kind::kFlag;
      key.whole = lua_toboolean(L, index);
      return true;
    default:
      return false;
  }
}

void PushKey(lua_State* L, const Key& key) {
  switch (key.kind) {
    case Key::Kind::kWhole:
      return lua_pushinteger(L, key.whole);
    case Key::Kind::kReal:
      return lua_pushnumber(L, key.real);
    case Key::Kind::kText:
      lua_pushlstring(L, key.text, key.bytes);
      return;
    case Key::Kind::kFlag:
      return lua_pushboolean(L, key.whole != 0);
  }
}

// Pushes a buffer with the keys of the table at `contents`, and returns it. The texts are the table's.
Key* PushKeys(lua_State* L, int contents, OtherKeys others, std::size_t& count) {
  Key key;
  count = 0;
  for (lua_pushnil(L); lua_next(L, contents) != 0; lua_pop(L, 1)) {
    const bool ordered = ReadKey(L, -2, key);
    if (!ordered && others == OtherKeys::kRefuse) {
      Raise(L, "pairs: a key that is %s has no order", ValueName(L, -2));
    }
    if (ordered) ++count;
  }
  Charge(L, 1 + kKeyWork * count);
  auto* const keys = static_cast<Key*>(lua_newuserdatauv(L, std::max<std::size_t>(1, count) * sizeof(Key), 0));
  std::size_t read = 0;
  for (lua_pushnil(L); lua_next(L, contents) != 0; lua_pop(L, 1)) {
    if (ReadKey(L, -2, key)) keys[read++] = key;
  }
  return keys;
}

// The state of a loop. `cursor` saves the search for the key in the list, and nothing follows from it. User values: the
// table and the list of its keys.
struct Loop {
  lua_Integer count, cursor;
};
constexpr int kLoopTable = 1, kLoopKeys = 2;
static_assert(sizeof(Loop) == kUserBytes[kUserLoop]);

// Position of the key at index 2 in the list at `keys`; 0 for nil, -1 for no key of the loop.
lua_Integer PositionOf(lua_State* L, const Loop& loop, int keys) {
  if (lua_isnil(L, 2)) return 0;
  for (lua_Integer i = 0; i < loop.count; ++i) {
    const lua_Integer position = (loop.cursor + i) % loop.count + 1;
    if (i % 16 == 1) Charge(L, 16);
    lua_rawgeti(L, keys, position);
    const bool found = lua_rawequal(L, 2, -1) != 0;
    lua_pop(L, 1);
    if (found) return position;
  }
  return -1;
}

int LoopNext(lua_State* L) {
  lua_settop(L, 2);
  if (UserTypeOf(L, 1) != kUserLoop) Raise(L, "pairs: its function is for loops only");
  Loop& loop = *static_cast<Loop*>(lua_touserdata(L, 1));
  lua_getiuservalue(L, 1, kLoopTable);
  lua_getiuservalue(L, 1, kLoopKeys);
  lua_Integer position = PositionOf(L, loop, 4);
  if (position < 0) Raise(L, "pairs: its function is for loops only");
  while (position < loop.count) {
    ++position;
    lua_rawgeti(L, 4, position);
    lua_pushvalue(L, -1);
    if (lua_rawget(L, 3) != LUA_TNIL) {
      loop.cursor = position - 1;
      return 2;
    }
    lua_pop(L, 2);  // removed since the loop began
  }
  return 0;
}

}  // namespace

void PushSortedKeys(lua_State* L, int index, OtherKeys others) {
  luaL_checkstack(L, 8, nullptr);
  PushContents(L, index);
  const int contents = lua_gettop(L);
  std::size_t count = 0;
  Key* const keys = PushKeys(L, contents, others, count);
  // Comparing raises no error, and the order of keys is total, so which algorithm sorts them makes no difference.
  std::sort(keys, keys + count);
  lua_createtable(L, static_cast<int>(count), 0);
  for (std::size_t i = 0; i < count; ++i) {
    PushKey(L, keys[i]);
    lua_rawseti(L, -2, static_cast<lua_Integer>(i) + 1);
  }
  lua_replace(L, contents);
  lua_settop(L, contents);
}

int Pairs(lua_State* L) {
  luaL_checkany(L, 1);
  lua_settop(L, 1);
  if (luaL_getmetafield(L, 1, "__pairs") != LUA_TNIL) {
    lua_pushvalue(L, 1);
    lua_call(L, 1, 3);
    return 3;
  }
  luaL_checktype(L, 1, LUA_TTABLE);
  lua_pushcfunction(L, LoopNext);
  Loop& loop = *static_cast<Loop*>(lua_newuserdatauv(L, sizeof(Loop), 2));
  loop = {};
  lua_rawgeti(L, LUA_REGISTRYINDEX, Runtime::Of(L).metatable_references[kUserLoop]);
  lua_setmetatable(L, -2);
  PushContents(L, 1);
  lua_setiuservalue(L, -2, kLoopTable);
  if (!PushFrozenKeys(L, 1)) PushSortedKeys(L, 1, OtherKeys::kRefuse);
  loop.count = static_cast<lua_Integer>(lua_rawlen(L, -1));
  lua_setiuservalue(L, -2, kLoopKeys);
  lua_pushnil(L);
  return 3;
}

int Next(lua_State* L) {
  luaL_checktype(L, 1, LUA_TTABLE);
  if (!lua_isnoneornil(L, 2)) Raise(L, "next: takes a table only and gives its first key; use pairs for the others");
  lua_settop(L, 1);
  PushContents(L, 1);
  if (PushFrozenKeys(L, 1)) {
    if (lua_rawgeti(L, 3, 1) == LUA_TNIL) return 1;
    lua_pushvalue(L, -1);
    lua_rawget(L, 2);
    return 2;
  }
  std::size_t count = 0;
  const Key* const keys = PushKeys(L, 2, OtherKeys::kRefuse, count);
  if (count == 0) {
    lua_pushnil(L);
    return 1;
  }
  PushKey(L, *std::min_element(keys, keys + count));
  lua_pushvalue(L, -1);
  lua_rawget(L, 2);
  return 2;
}

void SetUpLoops(lua_State* L) {
  lua_pushliteral(L, "loop");
  lua_setfield(L, -2, "__name");
}

}  // namespace tessera::game
