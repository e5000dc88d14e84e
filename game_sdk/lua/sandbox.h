// Sandbox: the globals that game code finds. All of them are listed in sandbox.cpp; there is nothing that reads a file
// or a clock, loads code, runs coroutines, or shows an address or the collector's work.
//
// Thread rule: as lua_State.
#pragma once

#include "lua.hpp"

namespace tessera::game {

// Makes metatables and globals of a new state; a lua_CFunction without arguments.
int SetUpState(lua_State* L);

// Has the table on top raise an error for keys that it lacks, as names that are not defined.
void RequireDefinedNames(lua_State* L);

}  // namespace tessera::game
