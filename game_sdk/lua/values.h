// Values: between those of the ABI and those of Lua, and the names of both in errors.
//
// Thread rule: as lua_State.
#pragma once

#include <string_view>

#include "game_sdk/api/api.h"
#include "lua.hpp"

namespace tessera::game {

// A parameter of a function, as errors name it.
struct ParameterName {
  std::string_view function, parameter;
  bool options = false;  // Parameter::options: lists and rotations may be among named values
};

// Converts the value at `index` to one of `types`, or raises an error that names the parameter. Where whole and real
// numbers are allowed, a real one with a whole value becomes whole. May push values on which `value` depends.
void ToValue(lua_State* L, int index, Types types, const ParameterName& name, tessera_game_value& value);

// Pushes a value of the host that may allocate memory. Needs 5 free places on the stack.
void PushAnyValue(lua_State* L, const tessera_game_value& value);
// The same for all values, quicker for flags and numbers.
inline void PushValue(lua_State* L, const tessera_game_value& value) {
  switch (value.type) {
    case TESSERA_GAME_FLAG:
      return lua_pushboolean(L, value.as.whole != 0);
    case TESSERA_GAME_WHOLE:
      return lua_pushinteger(L, value.as.whole);
    case TESSERA_GAME_REAL:
      return lua_pushnumber(L, value.as.real);
    default:
      return PushAnyValue(L, value);
  }
}

// "a text", "a vector", "a table": what a Lua value is. A constant.
const char* ValueName(lua_State* L, int index);
// "vector", "body", "table": `type` for game code. A constant.
const char* ValueType(lua_State* L, int index);

// tostring: pushes a text that names no address, and returns it. May call __tostring.
const char* PushText(lua_State* L, int index, std::size_t* bytes);

}  // namespace tessera::game
