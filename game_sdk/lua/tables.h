// The table library for game code: its work is counted, its results are bounded and the same in each run, and frozen
// tables are read but not written.
//
// Thread rule: as lua_State.
#pragma once

#include "lua.hpp"

namespace tessera::game {

// Pushes the table `table`: concat, insert, move, pack, remove, sort, unpack.
void PushTableLibrary(lua_State* L);

}  // namespace tessera::game
