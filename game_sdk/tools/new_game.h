// NewGame: the files of a game that is begun: a small world with a game that runs, its tests, and what editors need.
//
//   for (const GameFile& file : NewGame("arena")) write(folder + "/" + file.name, file.bytes);
//
// Thread rule: a function of its argument.
#pragma once

#include <string>
#include <vector>

#include "core/game/game_host.h"

namespace tessera::game {

// Names are paths within the game's folder. `name` is what the scene is called: letters, digits, `_` and `-`.
std::vector<GameFile> NewGame(const std::string& name);

}  // namespace tessera::game
