// connect, disconnect and is_connected of bodies: joints that a game makes while the world runs.
//
// The region that owns the body with the lower id decides; other regions send it what they want as a message, with the
// points as the caller saw them. Thread rule: as calls.h.
#pragma once

#include <span>

#include "absl/status/statusor.h"
#include "core/game/calls.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

bool IsJointCall(std::uint32_t function);
// Arguments, after the body, have the types of the table.
absl::StatusOr<tessera_game_value> CallJoint(tessera_game_call& call, const Function& function, BodyId id,
                                             std::span<const tessera_game_value> arguments);
// Carries out a message that asks for a joint of `body`, which the region owns. What is refused is answered, too.
absl::Status CarryOutConnect(tessera_game_call& call, BodyId body, const Message& message);

// Looks after the joints of `body` that wait, at the beginning of a tick's callbacks: those whose bodies have met are
// made, those that took too long are given up, and those of removed bodies end.
void SettleJoints(Transaction& transaction, BodyId body, Tick now);
// Whether SettleJoints has anything to do.
bool MustSettleJoints(const GameWorld& world, BodyId body);

}  // namespace tessera::game
