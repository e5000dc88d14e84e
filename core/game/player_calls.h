// The functions of the table for players, player:name to player:respawn, and world.players and world.broadcast.
#pragma once

#include <span>

#include "absl/status/statusor.h"
#include "core/game/calls.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

// Carries out a function of a player. The arguments have the types of the table; the result points into the call.
absl::StatusOr<tessera_game_value> CallPlayer(tessera_game_call& call, const Function& function, PlayerNumber player,
                                              std::span<const tessera_game_value> arguments);
// The same for the functions of the world that are about its players.
absl::StatusOr<tessera_game_value> CallPlayers(tessera_game_call& call, const Function& function,
                                               std::span<const tessera_game_value> arguments);

}  // namespace tessera::game
