// spawn of the world: makes the bodies of a prefab.
//
// Thread rule: as calls.h.
#pragma once

#include "absl/status/statusor.h"
#include "core/game/arguments.h"
#include "core/game/calls.h"

namespace tessera::game {

// Arguments: the prefab's name, position, options. Returns the first body. NOT_FOUND, INVALID_ARGUMENT or
// RESOURCE_EXHAUSTED "spawn: ..." names what is wrong.
absl::StatusOr<tessera_game_value> CallSpawn(tessera_game_call& call, const Function& function,
                                             CallArguments arguments);

}  // namespace tessera::game
