#include "game_sdk/lua/texts.h"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "game_sdk/lua/format.h"
#include "game_sdk/lua/limits.h"
#include "game_sdk/lua/lua_state.h"

namespace tessera::game {
namespace {

std::string_view ToText(lua_State* L, int index) {
  std::size_t bytes = 0;
  const char* const text = luaL_checklstring(L, index, &bytes);
  return {text, bytes};
}

// Position of `what` at or after `from`, or npos. In linear time, which std::string_view does not promise.
std::size_t Find(std::string_view text, std::string_view what, std::size_t from) {
  if (from > text.size()) return std::string_view::npos;
  const void* const found = memmem(text.data() + from, text.size() - from, what.data(), what.size());
  if (found == nullptr) return std::string_view::npos;
  return static_cast<std::size_t>(static_cast<const char*>(found) - text.data());
}

int ChargedCall(lua_State* L) {
  if (lua_type(L, 1) == LUA_TSTRING) ChargeScan(L, lua_rawlen(L, 1));
  return lua_tocfunction(L, lua_upvalueindex(1))(L);
}

int Repeat(lua_State* L) {
  const std::size_t bytes = ToText(L, 1).size();
  const lua_Integer count = luaL_checkinteger(L, 2);
  const std::size_t separator_bytes = lua_isnoneornil(L, 3) ? 0 : ToText(L, 3).size();
  if (count > 0) {
    // An empty text is repeated in as many steps.
    const std::size_t each = std::max<std::size_t>(1, bytes + separator_bytes);
    if (static_cast<lua_Unsigned>(count) > kMaxTextBytes / each) Raise(L, "string.rep: the text has more than 64 KiB");
    Charge(L, static_cast<std::uint64_t>(count) / 2);
    ChargeText(L, static_cast<std::size_t>(count) * each);
  }
  return lua_tocfunction(L, lua_upvalueindex(1))(L);
}

// A part of a long text is cheap, so the result is what counts.
int Part(lua_State* L) {
  lua_tocfunction(L, lua_upvalueindex(1))(L);
  ChargeText(L, lua_rawlen(L, -1));
  return 1;
}

int Byte(lua_State* L) {
  const auto length = static_cast<lua_Integer>(ToText(L, 1).size());
  const lua_Integer first = luaL_optinteger(L, 2, 1), last = luaL_optinteger(L, 3, first);
  const lua_Integer begin = first < 0 ? std::max<lua_Integer>(length + first + 1, 1) : std::max<lua_Integer>(first, 1);
  const lua_Integer end = last < 0 ? length + last + 1 : std::min(last, length);
  if (end - begin >= kMaxUnpacked) Raise(L, "string.byte: more than %d values", kMaxUnpacked);
  Charge(L, kMaxUnpacked / 16);
  return lua_tocfunction(L, lua_upvalueindex(1))(L);
}

// Always plain: code for Lua's own find that relies on patterns gets an error where it says so, by a fourth argument.
int FindText(lua_State* L) {
  const std::string_view text = ToText(L, 1), what = ToText(L, 2);
  lua_Integer from = luaL_optinteger(L, 3, 1);
  if (!lua_isnoneornil(L, 4) && !(lua_isboolean(L, 4) && lua_toboolean(L, 4) != 0)) {
    Raise(L, "string.find: there are no patterns; the fourth argument is true or absent");
  }
  const auto length = static_cast<lua_Integer>(text.size());
  if (from < 0) from = std::max<lua_Integer>(length + from + 1, 1);
  from = std::max<lua_Integer>(from, 1);
  ChargeScan(L, text.size());
  const std::size_t found =
      from > length + 1 ? std::string_view::npos : Find(text, what, static_cast<std::size_t>(from - 1));
  if (found == std::string_view::npos) {
    lua_pushnil(L);
    return 1;
  }
  const auto before = static_cast<lua_Integer>(found);
  lua_pushinteger(L, before + 1);
  lua_pushinteger(L, before + static_cast<lua_Integer>(what.size()));
  return 2;
}

int Split(lua_State* L) {
  const std::string_view text = ToText(L, 1), separator = ToText(L, 2);
  if (separator.empty()) Raise(L, "string.split: the separator is empty");
  ChargeScan(L, text.size());
  lua_newtable(L);
  std::size_t begin = 0;
  for (lua_Integer part = 1;; ++part) {
    if (part % 8 == 0) Charge(L, 64);
    const std::size_t end = Find(text, separator, begin);
    const std::string_view piece = text.substr(begin, end == std::string_view::npos ? end : end - begin);
    lua_pushlstring(L, piece.data(), piece.size());
    lua_rawseti(L, -2, part);
    if (end == std::string_view::npos) return 1;
    begin = end + separator.size();
  }
}

int Replace(lua_State* L) {
  const std::string_view text = ToText(L, 1), from = ToText(L, 2), to = ToText(L, 3);
  if (from.empty()) Raise(L, "string.replace: the text to look for is empty");
  ChargeScan(L, 2 * text.size());
  std::size_t count = 0;
  for (std::size_t at = Find(text, from, 0); at != std::string_view::npos; at = Find(text, from, at + from.size())) {
    ++count;
  }
  const std::size_t total = text.size() + count * to.size() - count * from.size();
  if (total > kMaxTextBytes) Raise(L, "string.replace: the text has more than 64 KiB");
  Charge(L, 4 * count);
  ChargeText(L, total);
  luaL_Buffer buffer;
  char* out = luaL_buffinitsize(L, &buffer, total);
  std::size_t begin = 0;
  for (std::size_t at = Find(text, from, 0); at != std::string_view::npos; at = Find(text, from, begin)) {
    out = std::copy_n(text.data() + begin, at - begin, out);
    out = std::copy_n(to.data(), to.size(), out);
    begin = at + from.size();
  }
  std::copy_n(text.data() + begin, text.size() - begin, out);
  luaL_pushresultsize(&buffer, total);
  return 1;
}

// Upvalue 1 is the function's name.
int RefusePatterns(lua_State* L) {
  Raise(L, "string.%s: there are no patterns; use string.find, string.split or string.replace, which take plain texts",
        lua_tostring(L, lua_upvalueindex(1)));
}

// Sets a function of the table on top that has Lua's own of that name, in the table below, as its upvalue.
void Wrap(lua_State* L, const char* name, lua_CFunction function) {
  lua_getfield(L, -2, name);
  lua_pushcclosure(L, function, 1);
  lua_setfield(L, -2, name);
}

}  // namespace

void ChargeFirstArgument(lua_State* L) { lua_pushcclosure(L, ChargedCall, 1); }

void PushTextLibrary(lua_State* L) {
  constexpr luaL_Reg kFunctions[] = {
      {"find", FindText}, {"format", Format}, {"replace", Replace}, {"split", Split}, {nullptr, nullptr}};
  luaL_newlib(L, kFunctions);
  for (const char* const name : {"char", "lower", "reverse", "upper"}) Wrap(L, name, ChargedCall);
  lua_getfield(L, -2, "len");
  lua_setfield(L, -2, "len");
  Wrap(L, "sub", Part);
  Wrap(L, "rep", Repeat);
  Wrap(L, "byte", Byte);
  for (const char* const name : {"gmatch", "gsub", "match"}) {
    lua_pushstring(L, name);
    lua_pushcclosure(L, RefusePatterns, 1);
    lua_setfield(L, -2, name);
  }
  lua_remove(L, -2);
}

}  // namespace tessera::game
