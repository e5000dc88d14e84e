// CheckGame: finds faults of a Lua game without running a world, all of them at once.
//
//   for (const GameFault& fault : CheckGame({"game.lua", text}, *scene)) print(fault.line, fault.text);
//
// The file is loaded in the sandbox, with its bounds; and its source is looked through for names that nobody knows:
// callbacks, kinds and properties that the scene does not have, functions, globals; and for writes to what outlives a
// callback. It follows only what is certain from the text: which body a variable holds is known for the parameters of
// callbacks that stand within `kinds`, and for locals that are set to one of them; functions that the file calls while
// it loads may write what they like. So it finds no wrong name behind a table, an argument or a computed text.
//
// Thread rule: a function of its arguments.
#pragma once

#include <string>
#include <vector>

#include "core/game/game_host.h"

namespace tessera::game {

struct GameFault {
  int line = 0;      // 0: of the file as a whole
  std::string text;  // one line
  friend auto operator<=>(const GameFault&, const GameFault&) = default;
};

// Ascending by line; at most kMaxFaults.
std::vector<GameFault> CheckGame(const GameFile& game, const Scene& scene);
inline constexpr std::size_t kMaxFaults = 200;

}  // namespace tessera::game
