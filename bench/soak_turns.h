// SoakTurns: what happens to the world of the suite soak, turn by turn, drawn from a seed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tessera::bench {

enum class SoakTurnKind {
  kPlayers,     // some players leave, and as many others join
  kScale,       // to more regions, or back to fewer
  kDeath,       // kill -9 of a worker
  kCheckpoint,  // the whole world is written to disk
  kProperties,  // an operator sets properties of bodies
  kSpawns,      // the game makes bodies, which it removes later
};
inline constexpr SoakTurnKind kLastSoakTurn = SoakTurnKind::kSpawns;
const char* NameOf(SoakTurnKind kind);

struct SoakTurn {
  SoakTurnKind kind = SoakTurnKind::kPlayers;
  std::uint64_t draw = 0;  // decides whatever the turn has to choose
};

// One of each four is kPlayers, so players come and go in every minute of turns of 15 s; of the others each kind comes
// once before any comes again. The same seed draws the same turns, and fewer of them are the first of more.
std::vector<SoakTurn> DrawSoakTurns(std::uint64_t seed, std::size_t count);

}  // namespace tessera::bench
