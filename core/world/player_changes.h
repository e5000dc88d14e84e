// Orders that name players by what changed: a world of ten thousand has as many in a whole order, and one more a join.
//
// Such an order says in `players_since` by which order, the one before on the same stream, it is to be read. The first
// on a stream is whole.
//
//   if (!Continues(kept, order)) ...            // asks for a whole one
//   CompletePlayers(std::move(kept), order);    // now it says of players what both say
//
// Thread rule: pure functions.
#pragma once

#include "tessera/v1/worker_link.pb.h"

namespace tessera {

// True if the players of `next` can be read after `before`: it names all, or what changed since that one.
bool Continues(const v1::WorkerOrder& before, const v1::WorkerOrder& next);

// Requires Continues. `next` then names the players that both name, as of its own revision: all of them where `before`
// named all, or those that changed since the order before that. Costs no copy of a player that stays as it is.
void CompletePlayers(v1::WorkerOrder before, v1::WorkerOrder& next);

}  // namespace tessera
