// table.sort for game code: a stable merge sort. Lua's own picks the pivots of longer lists by the clock, so that equal
// values come out in another order in each run.
//
// Thread rule: as lua_State.
#pragma once

#include "lua.hpp"

namespace tessera::game {

// sort(list, less): the list is unchanged if `less` raises an error.
int Sort(lua_State* L);

}  // namespace tessera::game
