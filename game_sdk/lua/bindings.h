// Bindings: the functions of the table (game_sdk/api/api.h) as Lua functions: `world.tick()`, `body:impulse(v)`; and
// properties as fields of bodies: `body.health = 3`.
//
// Thread rule: as lua_State.
#pragma once

#include "game_sdk/api/api.h"
#include "game_sdk/lua/lua_state.h"
#include "lua.hpp"

namespace tessera::game {

// Pushes a table of the receiver's functions.
void PushFunctions(lua_State* L, Receiver receiver);

// Pushes the functions of the world.
void PushWorld(lua_State* L);
// Once the file has run and its tables are frozen: properties of the world are fields of it.
void SetUpWorldFields(lua_State* L);

// Adds what reads and writes fields to the metatable on top.
void SetUpBodyFields(lua_State* L);
void SetUpPlayerFields(lua_State* L);

// Calls the host, or raises its error. Requires arguments of the right types.
inline void CallHost(lua_State* L, const Function& function, const tessera_game_value* arguments, std::uint32_t count,
                     tessera_game_value& result) {
  const Runtime& runtime = Runtime::Of(L);
  result.type = TESSERA_GAME_NOTHING;
  if (runtime.host()->call(runtime.call(), function.number, arguments, count, &result) != 0) {
    Raise(L, "%s", runtime.host()->error(runtime.call()));
  }
}

}  // namespace tessera::game
