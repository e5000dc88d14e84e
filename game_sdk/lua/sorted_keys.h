// The order of keys: numbers ascending, then texts by their bytes, then false and true. `pairs` and `next` for game
// code follow it, since Lua's own order differs from process to process.
//
// Thread rule: as lua_State.
#pragma once

#include <cstdint>

#include "lua.hpp"

namespace tessera::game {

// Says how keys that have no order, such as tables, are treated.
enum class OtherKeys : std::uint8_t { kRefuse, kSkip };

// Pushes a list of the keys of the table at `index`, a frozen one's too, in their order.
void PushSortedKeys(lua_State* L, int index, OtherKeys others);

// pairs(t): visits the keys that the table has when the loop begins. `s` and `c` of the loop determine what comes next,
// so that a loop keeps no state.
int Pairs(lua_State* L);
// next(t): the first key and its value; nothing for an empty table. There is no next(t, key).
int Next(lua_State* L);

// Fills the metatable on top for the state of loops.
void SetUpLoops(lua_State* L);

}  // namespace tessera::game
