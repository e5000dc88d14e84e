// Bindings: the functions of the table (game_sdk/api/api.h) as Lua functions: `world.tick()`, `body:impulse(v)`; and
// properties as fields of bodies: `body.health = 3`.
//
// Thread rule: as lua_State.
#pragma once

#include "game_sdk/api/api.h"
#include "lua.hpp"

namespace tessera::game {

// Pushes a table of the receiver's functions.
void PushFunctions(lua_State* L, Receiver receiver);

// Adds what reads and writes fields to the metatable on top.
void SetUpBodyFields(lua_State* L);
void SetUpPlayerFields(lua_State* L);

// Calls the host, or raises its error. Requires arguments of the right types.
void CallHost(lua_State* L, const Function& function, const tessera_game_value* arguments, std::uint32_t count,
              tessera_game_value& result);

}  // namespace tessera::game
