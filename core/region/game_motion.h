// Carries out what a game's records do to bodies after a step, beside forces: bodies that are put elsewhere, and
// kinematic ones that a game moves.
//
// Both change what neighbours have to step, so they begin with a tick whose frame reaches all neighbours that they
// concern. With a game promises of silence last two ticks, and none is given while a body waits: so nothing waits
// longer.
//
// Thread rule: one thread at a time.
#pragma once

#include "core/game/record.h"
#include "core/region/frame.h"
#include "core/region/record_table.h"

namespace tessera::region {

struct RegionParts;

// Carries out what is due after a step and its game's callbacks. Does nothing where no record acts.
void MoveByGame(RegionParts& parts);

// Whether a body waits for a neighbour that is not listening.
bool AnyoneWaits(const RegionParts& parts);

// Adds to a ghost what a neighbour that steps it has to know of the game.
void AddGame(const game::GameRecord& game, float tick_rate_hz, GhostRecord& ghost);

}  // namespace tessera::region
