// Reach: what a game can still use after its file ran: all tables and functions that its globals lead to, by fields,
// keys, metatables and the variables that functions share with the file.
//
// Thread rule: as lua_State.
#pragma once

#include "lua.hpp"

namespace tessera::game {

// The list that `Reach` makes: object and path of each, in the order in which they were found.
inline constexpr int kReachedObject = 0, kReachedPath = 1, kReachedStride = 2;

// Pushes the list of what the table at `globals`, its first entry, and the functions of the list at `callbacks` lead
// to. Raises an error for what a game cannot keep, like the state of a loop.
void Reach(lua_State* L, int globals, int callbacks);

// Pushes the path of the key at `key` in the table with the path at `path`: `scores.red`, `scores[3]`.
void PushPath(lua_State* L, int path, int key);

}  // namespace tessera::game
