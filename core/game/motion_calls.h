// The functions of the table that move bodies and change how they move, carried out on a transaction. All of them act
// in the next tick, by the body's record.
#pragma once

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/game/calls.h"
#include "core/game/transaction.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

bool IsMotionCall(std::uint32_t function);

// Requires IsMotionCall(function.number), arguments that the table allows, and that the region owns the body.
absl::StatusOr<tessera_game_value> CallMotion(tessera_game_call& call, const Function& function, BodyId id,
                                              const BodyDef& def, Transaction::Changes& body,
                                              std::span<const tessera_game_value> arguments);

}  // namespace tessera::game
