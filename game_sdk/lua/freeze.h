// Freezing: after a game's file ran, its tables can be read and no more be written.
//
// A table is frozen in place: its contents move to a hidden one, its backing, and it gets a metatable that reads there
// and refuses to write. Metamethods that it had still work; where it is the metatable of other tables, `setmetatable`
// gives them the backing, in which Lua finds the metamethods.
//
// Thread rule: as lua_State.
#pragma once

#include "lua.hpp"

namespace tessera::game {

// Freezes the tables that `Reach` found, the list of which is on top of the stack. Leaves the stack as it was.
void FreezeAll(lua_State* L);

bool IsFrozen(lua_State* L, int index);
// Pushes the table that holds the contents: the backing of a frozen one, else the table itself.
void PushContents(lua_State* L, int index);
// Pushes the list of the keys of a frozen table in their order. Returns false, and pushes nothing, if the table is not
// frozen or has keys without an order.
bool PushFrozenKeys(lua_State* L, int index);
// Raises the error that a frozen table is written, at the key at `key`, or as a whole where that is 0.
[[noreturn]] void RaiseFrozen(lua_State* L, int index, int key);
// Raises that error if the table is frozen.
void RequireLive(lua_State* L, int index);

// setmetatable and getmetatable for game code.
int SetMetatable(lua_State* L);
int GetMetatable(lua_State* L);

}  // namespace tessera::game
