// Error texts: one line for each error of a game, which begins with file and line.
//
// Thread rule: as lua_State.
#pragma once

#include <string_view>

#include "game_sdk/lua/lua_state.h"

namespace tessera::game {

// The message handler of all calls: notes where the error arose and makes a text of what is none.
int HandleError(lua_State* L);

// Writes why a call failed, whose error is on top of the stack. `fallback` is the place where none is known: a line of
// the file, or 0.
void WriteCallError(const Runtime& runtime, int fallback_line, tessera_game_error& error);

// Writes a text as one line, with the file's name in front unless it is there.
void WriteError(const char* chunk, std::string_view text, tessera_game_error& error);

}  // namespace tessera::game
