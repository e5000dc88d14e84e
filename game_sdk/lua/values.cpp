#include "game_sdk/lua/values.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "game_sdk/lua/freeze.h"
#include "game_sdk/lua/handles.h"
#include "game_sdk/lua/limits.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/vectors.h"

namespace tessera::game {
namespace {

constexpr Types kNamedValue = kFlagType | kWholeType | kRealType | kTextType | kVectorType | kBodyType | kPlayerType;

enum class Fit : std::uint8_t { kFits, kWrongType, kNotFinite, kNotWhole };

Fit ToNumber(lua_State* L, int index, Types types, tessera_game_value& value) {
  if ((types & (kWholeType | kRealType)) == 0) return Fit::kWrongType;
  if (lua_isinteger(L, index) != 0 && (types & kWholeType) != 0) {
    value.type = TESSERA_GAME_WHOLE;
    value.as.whole = lua_tointeger(L, index);
    return Fit::kFits;
  }
  const lua_Number number = lua_tonumber(L, index);
  if (!std::isfinite(number)) return Fit::kNotFinite;
  const bool whole = number == std::floor(number) && number >= -0x1p63 && number < 0x1p63;
  if ((types & kWholeType) != 0 && whole) {
    value.type = TESSERA_GAME_WHOLE;
    value.as.whole = static_cast<std::int64_t>(number);
    return Fit::kFits;
  }
  if ((types & kRealType) == 0) return Fit::kNotWhole;
  value.type = TESSERA_GAME_REAL;
  value.as.real = number;
  return Fit::kFits;
}

Fit ToUserValue(lua_State* L, int index, Types types, tessera_game_value& value) {
  const void* const data = lua_touserdata(L, index);
  switch (UserTypeOf(L, index)) {
    case kUserVector: {
      if ((types & kVectorType) == 0) return Fit::kWrongType;
      const Vector& vector = *static_cast<const Vector*>(data);
      value.type = TESSERA_GAME_VECTOR;
      std::copy_n(vector.axes, 3, value.as.vector);
      const bool finite = std::all_of(vector.axes, vector.axes + 3, [](double axis) { return std::isfinite(axis); });
      return finite ? Fit::kFits : Fit::kNotFinite;
    }
    case kUserRotation:
      if ((types & kRotationType) == 0) return Fit::kWrongType;
      value.type = TESSERA_GAME_ROTATION;
      std::copy_n(static_cast<const Rotation*>(data)->axes, 4, value.as.rotation);
      return Fit::kFits;
    case kUserBody:
      if ((types & kBodyType) == 0) return Fit::kWrongType;
      value.type = TESSERA_GAME_BODY;
      value.as.id = static_cast<const Handle*>(data)->id;
      return Fit::kFits;
    case kUserPlayer:
      if ((types & kPlayerType) == 0) return Fit::kWrongType;
      value.type = TESSERA_GAME_PLAYER;
      value.as.id = static_cast<const Handle*>(data)->id;
      return Fit::kFits;
    default:
      return Fit::kWrongType;
  }
}

// Converts anything but a table.
Fit ToPlainValue(lua_State* L, int index, Types types, tessera_game_value& value) {
  value.count = 0;
  switch (lua_type(L, index)) {
    case LUA_TNIL:
    case LUA_TNONE:
      value.type = TESSERA_GAME_NOTHING;
      return (types & kNothingType) != 0 ? Fit::kFits : Fit::kWrongType;
    case LUA_TBOOLEAN:
      value.type = TESSERA_GAME_FLAG;
      value.as.whole = lua_toboolean(L, index);
      return (types & kFlagType) != 0 ? Fit::kFits : Fit::kWrongType;
    case LUA_TNUMBER:
      return ToNumber(L, index, types, value);
    case LUA_TSTRING: {
      if ((types & kTextType) == 0) return Fit::kWrongType;
      std::size_t bytes = 0;
      value.type = TESSERA_GAME_TEXT;
      value.as.text = lua_tolstring(L, index, &bytes);
      value.count = static_cast<std::uint32_t>(bytes);
      return Fit::kFits;
    }
    case LUA_TUSERDATA:
      return ToUserValue(L, index, types, value);
    default:
      return Fit::kWrongType;
  }
}

// Writes "a number, a text or nothing".
void DescribeTypes(Types types, char* out, std::size_t bytes) {
  if ((types & kRealType) != 0) types &= ~kWholeType;
  std::size_t used = 0;
  out[0] = '\0';
  for (unsigned type = 1; type <= TESSERA_GAME_FIELDS + 1; ++type) {
    const unsigned named = type % (TESSERA_GAME_FIELDS + 1);  // "nothing" comes last
    const Types bit = Types{1} << named;
    if ((types & bit) == 0) continue;
    const std::string_view name = TypeName(static_cast<tessera_game_type>(named));
    const Types left = types & ~bit & ~((Types{1} << type) - 1);
    const bool last = left == 0 && ((types & kNothingType) == 0 || named == TESSERA_GAME_NOTHING);
    const char* const before = used == 0 ? "" : last ? " or " : ", ";
    const int written =
        std::snprintf(out + used, bytes - used, "%s%.*s", before, static_cast<int>(name.size()), name.data());
    used = std::min(used + static_cast<std::size_t>(written), bytes - 1);
  }
}

// Raises why the value at `index` does not fit; `key` is the name within a table of named values, or empty.
[[noreturn]] void RaiseMisfit(lua_State* L, int index, Types types, const ParameterName& name, std::string_view key,
                              Fit fit) {
  char wanted[160], subject[160];
  DescribeTypes(types, wanted, sizeof wanted);
  std::snprintf(subject, sizeof subject, "%.*s: `%.*s%s%.*s`", static_cast<int>(name.function.size()),
                name.function.data(), static_cast<int>(name.parameter.size()), name.parameter.data(),
                key.empty() ? "" : ".", static_cast<int>(std::min<std::size_t>(key.size(), 60)), key.data());
  if (fit == Fit::kNotFinite) Raise(L, "%s must be finite", subject);
  if (lua_isnoneornil(L, index)) Raise(L, "%s is missing; it must be %s", subject, wanted);
  if (fit == Fit::kNotWhole) Raise(L, "%s must be %s, got %.14g", subject, wanted, lua_tonumber(L, index));
  Raise(L, "%s must be %s, got %s", subject, wanted, ValueName(L, index));
}

// Counts the entries of the table at `contents`, all of which have texts as keys.
std::size_t CountFields(lua_State* L, int contents, const ParameterName& name) {
  std::size_t count = 0;
  for (lua_pushnil(L); lua_next(L, contents) != 0; lua_pop(L, 1)) {
    if (lua_type(L, -2) != LUA_TSTRING) {
      Raise(L, "%.*s: `%.*s` has a key that is %s; its keys must be texts", static_cast<int>(name.function.size()),
            name.function.data(), static_cast<int>(name.parameter.size()), name.parameter.data(), ValueName(L, -2));
    }
    if (++count > kMaxFields) {
      Raise(L, "%.*s: `%.*s` has more than %d values", static_cast<int>(name.function.size()), name.function.data(),
            static_cast<int>(name.parameter.size()), name.parameter.data(), kMaxFields);
    }
  }
  return count;
}

// Converts the list at `index` within a table of options. Pushes nothing; what the list needs is put into the table at
// `held`, which keeps it alive.
void ToListOption(lua_State* L, int index, int held, const ParameterName& name, std::string_view key,
                  tessera_game_value& value) {
  luaL_checkstack(L, 8, nullptr);
  PushContents(L, index);
  const int contents = lua_gettop(L);
  const lua_Unsigned count = lua_rawlen(L, contents);
  lua_Unsigned entries = 0;
  for (lua_pushnil(L); lua_next(L, contents) != 0; lua_pop(L, 1)) {
    if (++entries > count || entries > kMaxFields) break;
  }
  if (entries != count || count > kMaxFields) {
    Raise(L, "%.*s: `%.*s.%.*s` must be a list of at most %d", static_cast<int>(name.function.size()),
          name.function.data(), static_cast<int>(name.parameter.size()), name.parameter.data(),
          static_cast<int>(std::min<std::size_t>(key.size(), 60)), key.data(), kMaxFields);
  }
  auto* const list = static_cast<tessera_game_value*>(
      lua_newuserdatauv(L, std::max<std::size_t>(1, count) * sizeof(tessera_game_value), 0));
  lua_rawseti(L, held, static_cast<lua_Integer>(lua_rawlen(L, held)) + 1);
  for (lua_Unsigned i = 0; i < count; ++i) {
    lua_rawgeti(L, contents, static_cast<lua_Integer>(i) + 1);
    const Fit fit = ToPlainValue(L, -1, kNamedValue, list[i]);
    if (fit != Fit::kFits) RaiseMisfit(L, -1, kNamedValue, name, key, fit);
    lua_pop(L, 1);  // its table keeps a text alive
  }
  lua_pop(L, 1);
  value.type = TESSERA_GAME_LIST;
  value.count = static_cast<std::uint32_t>(count);
  value.as.list = list;
}

void ToFields(lua_State* L, int table, const ParameterName& name, tessera_game_value& value) {
  PushContents(L, table);
  const int contents = lua_gettop(L);
  const std::size_t count = CountFields(L, contents, name);
  if (name.options) lua_newtable(L);  // keeps what lists need
  const int held = lua_gettop(L);
  auto* const fields = static_cast<tessera_game_field*>(
      lua_newuserdatauv(L, std::max<std::size_t>(1, count) * sizeof(tessera_game_field), 0));
  std::size_t filled = 0;
  for (lua_pushnil(L); lua_next(L, contents) != 0; lua_pop(L, 1)) {
    tessera_game_field& field = fields[filled++];
    field.name = lua_tolstring(L, -2, &field.name_bytes);
    // 3.0 stays a real number here: no declared type says what it will be.
    const bool real = lua_type(L, -1) == LUA_TNUMBER && lua_isinteger(L, -1) == 0;
    const std::string_view key(field.name, field.name_bytes);
    if (name.options && lua_istable(L, -1)) {
      ToListOption(L, lua_gettop(L), held, name, key, field.value);
      continue;
    }
    const Types types = name.options ? kNamedValue | kRotationType : kNamedValue;
    const Fit fit = ToPlainValue(L, -1, real ? types & ~kWholeType : types, field.value);
    if (fit != Fit::kFits) RaiseMisfit(L, -1, types, name, key, fit);
  }
  std::sort(fields, fields + count, [](const tessera_game_field& a, const tessera_game_field& b) {
    return std::string_view(a.name, a.name_bytes) < std::string_view(b.name, b.name_bytes);
  });
  value.type = TESSERA_GAME_FIELDS;
  value.count = static_cast<std::uint32_t>(count);
  value.as.fields = fields;
}

void PushList(lua_State* L, const tessera_game_value& value) {
  luaL_checkstack(L, 8, nullptr);
  lua_createtable(L, static_cast<int>(value.count), 0);
  for (std::uint32_t i = 0; i < value.count; ++i) {
    PushValue(L, value.as.list[i]);
    lua_rawseti(L, -2, lua_Integer{i} + 1);
  }
}

void PushFields(lua_State* L, const tessera_game_value& value) {
  luaL_checkstack(L, 8, nullptr);
  lua_createtable(L, 0, static_cast<int>(value.count));
  for (std::uint32_t i = 0; i < value.count; ++i) {
    const tessera_game_field& field = value.as.fields[i];
    lua_pushlstring(L, field.name, field.name_bytes);
    PushValue(L, field.value);
    lua_rawset(L, -3);
  }
}

struct TypeNames {
  const char *type, *with_article;
};

TypeNames NamesOf(lua_State* L, int index) {
  switch (lua_type(L, index)) {
    case LUA_TNIL:
    case LUA_TNONE:
      return {"nil", "nothing"};
    case LUA_TBOOLEAN:
      return {"boolean", lua_toboolean(L, index) != 0 ? "true" : "false"};
    case LUA_TNUMBER:
      return {"number", lua_isinteger(L, index) != 0 ? "a whole number" : "a number"};
    case LUA_TSTRING:
      return {"string", "a text"};
    case LUA_TTABLE:
      return {"table", "a table"};
    case LUA_TFUNCTION:
      return {"function", "a function"};
    default:
      break;
  }
  switch (UserTypeOf(L, index)) {
    case kUserVector:
      return {"vector", "a vector"};
    case kUserRotation:
      return {"rotation", "a rotation"};
    case kUserBody:
      return {"body", "a body"};
    case kUserPlayer:
      return {"player", "a player"};
    default:
      return {"userdata", "the state of a loop"};
  }
}

}  // namespace

void ToValue(lua_State* L, int index, Types types, const ParameterName& name, tessera_game_value& value) {
  if ((types & kFieldsType) != 0 && lua_istable(L, index)) return ToFields(L, index, name, value);
  const Fit fit = ToPlainValue(L, index, types, value);
  if (fit != Fit::kFits) RaiseMisfit(L, index, types, name, {}, fit);
}

void PushAnyValue(lua_State* L, const tessera_game_value& value) {
  switch (value.type) {
    case TESSERA_GAME_TEXT:
      lua_pushlstring(L, value.as.text, value.count);
      return;
    case TESSERA_GAME_VECTOR:
      return PushVector(L, {{value.as.vector[0], value.as.vector[1], value.as.vector[2]}});
    case TESSERA_GAME_ROTATION: {
      const double* const axes = value.as.rotation;
      return PushRotation(L, {{axes[0], axes[1], axes[2], axes[3]}});
    }
    case TESSERA_GAME_BODY:
      return PushHandle(L, kUserBody, value.as.id);
    case TESSERA_GAME_PLAYER:
      return PushHandle(L, kUserPlayer, value.as.id);
    case TESSERA_GAME_LIST:
      return PushList(L, value);
    case TESSERA_GAME_FIELDS:
      return PushFields(L, value);
    default:
      return lua_pushnil(L);
  }
}

const char* ValueName(lua_State* L, int index) { return NamesOf(L, index).with_article; }
const char* ValueType(lua_State* L, int index) { return NamesOf(L, index).type; }

const char* PushText(lua_State* L, int index, std::size_t* bytes) {
  index = lua_absindex(L, index);
  luaL_checkstack(L, 8, nullptr);
  if (luaL_callmeta(L, index, "__tostring") != 0) {
    if (lua_type(L, -1) != LUA_TSTRING) Raise(L, "__tostring must return a text, got %s", ValueName(L, -1));
    return lua_tolstring(L, -1, bytes);
  }
  switch (lua_type(L, index)) {
    case LUA_TNUMBER:
    case LUA_TSTRING:
      lua_pushvalue(L, index);
      break;
    case LUA_TBOOLEAN:
      lua_pushstring(L, lua_toboolean(L, index) != 0 ? "true" : "false");
      break;
    default:
      lua_pushstring(L, ValueType(L, index));
  }
  return lua_tolstring(L, -1, bytes);
}

}  // namespace tessera::game
