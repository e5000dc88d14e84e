// Handles of bodies and players in Lua: an id each, and nothing of the state, which the host has.
//
// One id has one handle as long as game code holds it, so that handles can be keys of tables.
//
// Thread rule: as lua_State.
#pragma once

#include <cstdint>

#include "game_sdk/lua/lua_state.h"

namespace tessera::game {

struct Handle {
  std::uint64_t id;
};
static_assert(sizeof(Handle) == kUserBytes[kUserBody] && sizeof(Handle) < kUserBytes[kUserPlayer]);

// `type` is kUserBody or kUserPlayer.
void PushHandle(lua_State* L, UserType type, std::uint64_t id);
// The same for a body whose handle was used lately. Otherwise it pushes nothing and returns false. Raises no error.
bool PushRecentHandle(lua_State* L, std::uint64_t id);

// Fills the metatable on top, but for what reads and writes fields.
void SetUpHandles(lua_State* L, UserType type);

}  // namespace tessera::game
