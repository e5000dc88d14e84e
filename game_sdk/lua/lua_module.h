// The Lua host: a game module (game_sdk/include/tessera/game.h) whose sources are Lua files.
//
//   function on_tick() world.log("tick " .. world.tick()) end      -- a callback of the world
//   kinds.crate = {                                                 -- callbacks of bodies of the kind "crate"
//     on_contact = function(self, other) self.health = self.health - 1 end
//   }
//
// Promises: a game gives the same effects in each run and in a fresh state, whatever it ran before; nothing that it
// stores outlives a callback; no source and no call crashes, or uses more time and memory than game_sdk/lua/limits.h
// and the host's budget say; each error is one line with file and line.
//
// Thread rule: one game is used by one thread at a time; different games are independent.
#pragma once

#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

const tessera_game_module* LuaGameModule();

}  // namespace tessera::game
