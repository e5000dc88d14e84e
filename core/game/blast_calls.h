// explode of the world: asks for an area effect (blast.h).
#pragma once

#include <span>

#include "absl/status/statusor.h"
#include "core/game/calls.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

// Arguments have the types of the table.
absl::StatusOr<tessera_game_value> CallExplode(tessera_game_call& call, const Function& function,
                                               std::span<const tessera_game_value> arguments);

}  // namespace tessera::game
