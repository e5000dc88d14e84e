// The string library for game code: no patterns, bounded results, and work that is counted.
//
// Thread rule: as lua_State.
#pragma once

#include "lua.hpp"

namespace tessera::game {

// Pushes the table `string`: byte, char, find, format, len, lower, rep, replace, reverse, split, sub, upper. Takes
// Lua's own table `string` from the top of the stack.
void PushTextLibrary(lua_State* L);

// Pushes a function that counts the bytes of its first argument as work and does what the C function on top does, which
// it replaces. That function must have no upvalues.
void ChargeFirstArgument(lua_State* L);

}  // namespace tessera::game
