// The world's time and the game's own counters: world.time and world.count.
#pragma once

#include <span>

#include "absl/status/statusor.h"
#include "core/game/calls.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

// Carries out `function`, whose arguments have the types of the table.
absl::StatusOr<tessera_game_value> CallClock(tessera_game_call& call, const Function& function,
                                             std::span<const tessera_game_value> arguments);

}  // namespace tessera::game
