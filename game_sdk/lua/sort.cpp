#include "game_sdk/lua/sort.h"

#include <algorithm>
#include <utility>

#include "game_sdk/lua/freeze.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/values.h"

namespace tessera::game {
namespace {

// Stack positions.
constexpr int kList = 1, kLess = 2;

// Whether the value on top comes before the one below it.
bool TopIsLess(lua_State* L) {
  if (lua_isnil(L, kLess)) return lua_compare(L, -1, -2, LUA_OPLT) != 0;
  lua_pushvalue(L, kLess);
  lua_pushvalue(L, -2);
  lua_pushvalue(L, -4);
  lua_call(L, 2, 1);
  const bool less = lua_toboolean(L, -1) != 0;
  lua_pop(L, 1);
  return less;
}

// Merges the sorted runs [begin, middle) and [middle, end) of the table at `from` into the one at `to`.
void Merge(lua_State* L, int from, int to, lua_Integer begin, lua_Integer middle, lua_Integer end) {
  lua_Integer left = begin, right = middle;
  for (lua_Integer out = begin; out < end; ++out) {
    if (left < middle && right < end) {
      lua_rawgeti(L, from, left);
      lua_rawgeti(L, from, right);
      const bool take_right = TopIsLess(L);
      lua_pop(L, take_right ? 2 : 1);
      if (take_right) {
        lua_rawgeti(L, from, right++);
      } else {
        ++left;
      }
    } else {
      lua_rawgeti(L, from, left < middle ? left++ : right++);
    }
    lua_rawseti(L, to, out);
  }
}

}  // namespace

int Sort(lua_State* L) {
  luaL_checktype(L, kList, LUA_TTABLE);
  if (!lua_isnoneornil(L, kLess)) luaL_checktype(L, kLess, LUA_TFUNCTION);
  lua_settop(L, 2);
  RequireLive(L, kList);
  const lua_Integer count = luaL_len(L, kList);
  if (count < 2) return 0;
  // The copy below fills the memory of a longer list, whatever its __len says.
  const auto work = static_cast<std::uint64_t>(count);
  Charge(L, 4 * work);
  const int presized = static_cast<int>(std::min<lua_Integer>(count, 1 << 20));
  lua_createtable(L, presized, 0);
  lua_createtable(L, presized, 0);
  int from = 3, to = 4;
  for (lua_Integer i = 1; i <= count; ++i) {
    if (lua_geti(L, kList, i) == LUA_TNIL) {
      Raise(L, "table.sort: value %lld is nothing; a list has no gaps", static_cast<long long>(i));
    }
    lua_rawseti(L, from, i);
  }
  for (lua_Integer run = 1; run < count; run *= 2) {
    Charge(L, 4 * work);
    for (lua_Integer begin = 1; begin <= count; begin += 2 * run) {
      Merge(L, from, to, begin, std::min(begin + run, count + 1), std::min(begin + 2 * run, count + 1));
    }
    std::swap(from, to);
  }
  for (lua_Integer i = 1; i <= count; ++i) {
    lua_rawgeti(L, from, i);
    lua_seti(L, kList, i);
  }
  return 0;
}

}  // namespace tessera::game
