#include "game_sdk/lua/tables.h"

#include <algorithm>

#include "game_sdk/lua/freeze.h"
#include "game_sdk/lua/limits.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/sort.h"
#include "game_sdk/lua/values.h"

namespace tessera::game {
namespace {

lua_Integer LengthOf(lua_State* L, int index) {
  luaL_checktype(L, index, LUA_TTABLE);
  return luaL_len(L, index);
}

int Concat(lua_State* L) {
  const lua_Integer length = LengthOf(L, 1);
  std::size_t separator_bytes = 0;
  const char* const separator = luaL_optlstring(L, 2, "", &separator_bytes);
  const lua_Integer first = luaL_optinteger(L, 3, 1), last = luaL_optinteger(L, 4, length);
  luaL_Buffer buffer;
  luaL_buffinit(L, &buffer);
  std::size_t total = 0;
  for (lua_Integer i = first; i <= last; ++i) {
    lua_geti(L, 1, i);
    if (lua_isstring(L, -1) == 0) {
      Raise(L, "table.concat: value %lld is %s; it must be a text or a number", static_cast<long long>(i),
            ValueName(L, -1));
    }
    std::size_t bytes = 0;
    lua_tolstring(L, -1, &bytes);
    total += bytes + separator_bytes;
    if (total > kMaxTextBytes + separator_bytes) Raise(L, "table.concat: the text has more than 64 KiB");
    ChargeText(L, bytes + separator_bytes);
    luaL_addvalue(&buffer);
    if (i == last) break;  // also where i + 1 is beyond all integers
    luaL_addlstring(&buffer, separator, separator_bytes);
  }
  luaL_pushresult(&buffer);
  return 1;
}

int Insert(lua_State* L) {
  const lua_Integer end = LengthOf(L, 1) + 1;
  const int given = lua_gettop(L);
  if (given != 2 && given != 3) Raise(L, "table.insert: takes a table, a position and a value, or a table and a value");
  const lua_Integer position = given == 2 ? end : luaL_checkinteger(L, 2);
  if (position < 1 || position > end) {
    Raise(L, "table.insert: position %lld is not between 1 and %lld", static_cast<long long>(position),
          static_cast<long long>(end));
  }
  if (IsFrozen(L, 1)) {
    lua_pushinteger(L, position);
    RaiseFrozen(L, 1, lua_gettop(L));
  }
  Charge(L, 1 + static_cast<std::uint64_t>(end - position));
  for (lua_Integer i = end; i > position; --i) {
    lua_geti(L, 1, i - 1);
    lua_seti(L, 1, i);
  }
  lua_seti(L, 1, position);
  return 0;
}

int Remove(lua_State* L) {
  const lua_Integer length = LengthOf(L, 1);
  const lua_Integer position = luaL_optinteger(L, 2, length);
  if (IsFrozen(L, 1)) {
    lua_pushinteger(L, position);
    RaiseFrozen(L, 1, lua_gettop(L));
  }
  const bool at_end = lua_isnoneornil(L, 2);
  if (!at_end && (position < 1 || position > length + 1) && !(length == 0 && position == 0)) {
    Raise(L, "table.remove: position %lld is not between 1 and %lld", static_cast<long long>(position),
          static_cast<long long>(length + 1));
  }
  Charge(L, 1 + static_cast<std::uint64_t>(std::max<lua_Integer>(0, length - position)));
  lua_geti(L, 1, position);
  lua_Integer i = position;
  for (; i < length; ++i) {
    lua_geti(L, 1, i + 1);
    lua_seti(L, 1, i);
  }
  lua_pushnil(L);
  lua_seti(L, 1, i);
  return 1;
}

int Move(lua_State* L) {
  const lua_Integer first = luaL_checkinteger(L, 2), last = luaL_checkinteger(L, 3), to = luaL_checkinteger(L, 4);
  const int target = lua_isnoneornil(L, 5) ? 1 : 5;
  luaL_checktype(L, 1, LUA_TTABLE);
  luaL_checktype(L, target, LUA_TTABLE);
  RequireLive(L, target);
  if (last >= first) {
    // As in Lua: neither the count nor the last target may overflow.
    if (first <= 0 && last >= LUA_MAXINTEGER + first) Raise(L, "table.move: too many values");
    const lua_Integer count = last - first + 1;
    if (to > LUA_MAXINTEGER - count + 1) Raise(L, "table.move: the target is beyond all integers");
    Charge(L, static_cast<std::uint64_t>(count));
    const bool forward = to > last || to <= first || (target != 1 && lua_compare(L, 1, target, LUA_OPEQ) == 0);
    for (lua_Integer n = 0; n < count; ++n) {
      const lua_Integer i = forward ? n : count - 1 - n;
      lua_geti(L, 1, first + i);
      lua_seti(L, target, to + i);
    }
  }
  lua_pushvalue(L, target);
  return 1;
}

int Pack(lua_State* L) {
  const int count = lua_gettop(L);
  Charge(L, static_cast<std::uint64_t>(count));
  lua_createtable(L, count, 1);
  lua_insert(L, 1);
  for (int i = count; i >= 1; --i) lua_rawseti(L, 1, i);
  lua_pushinteger(L, count);
  lua_setfield(L, 1, "n");
  return 1;
}

int Unpack(lua_State* L) {
  const lua_Integer first = luaL_optinteger(L, 2, 1);
  const lua_Integer last = lua_isnoneornil(L, 3) ? LengthOf(L, 1) : luaL_checkinteger(L, 3);
  if (first > last) return 0;
  const auto count = static_cast<lua_Unsigned>(last) - static_cast<lua_Unsigned>(first);
  if (count >= kMaxUnpacked) Raise(L, "table.unpack: more than %d values", kMaxUnpacked);
  Charge(L, count);
  luaL_checkstack(L, static_cast<int>(count) + 1, nullptr);
  for (lua_Unsigned i = 0; i <= count; ++i) {
    lua_geti(L, 1, static_cast<lua_Integer>(static_cast<lua_Unsigned>(first) + i));
  }
  return static_cast<int>(count) + 1;
}

}  // namespace

void PushTableLibrary(lua_State* L) {
  constexpr luaL_Reg kFunctions[] = {{"concat", Concat}, {"insert", Insert}, {"move", Move},     {"pack", Pack},
                                     {"remove", Remove}, {"sort", Sort},     {"unpack", Unpack}, {nullptr, nullptr}};
  luaL_newlib(L, kFunctions);
}

}  // namespace tessera::game
