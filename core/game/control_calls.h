// Which body a player's inputs move: control and controlled of players, controller of bodies.
//
// A player who moves another body than its own keeps its own body, which stands aside and goes wherever the other one
// goes; the player's record, inputs and commands stay with it. Both records name each other, and control is in force
// while one region owns both. To get there the player's own body sends the other one a message. Its owner decides: the
// first that comes has it, the others are answered with the reason. It holds the body for the player, who is put where
// it is and so comes to its region. What was parted, or takes too long, ends at both ends by itself.
//
// Thread rule: as calls.h.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/game/calls.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

// control of a player whose own body is `own`, which the region owns.
absl::StatusOr<tessera_game_value> CallControl(tessera_game_call& call, const Function& function, PlayerNumber player,
                                               std::span<const tessera_game_value> arguments);
// controlled of a player, and controller of a body.
tessera_game_value ControlledBy(const tessera_game_call& call, PlayerNumber player);
absl::StatusOr<tessera_game_value> ControllerOf(const tessera_game_call& call, const Function& function, BodyId id);
// set_limits of a player.
absl::StatusOr<tessera_game_value> CallSetLimits(const Function& function, PlayerRecord& record,
                                                 std::span<const tessera_game_value> arguments);

// Ends what the player moves beside its own body, and takes back what was asked for. A player who did looks on from
// there. The region owns the player's body.
void ReleaseControl(Transaction& transaction, PlayerNumber player);

// Carries out a message that asks for `target`, or one that answers the player whose body it is.
absl::Status CarryOutControl(tessera_game_call& call, BodyId target, const Message& message);

// Looks after `id`, which is asked for, held or moved by a player, or the body of such a player.
std::vector<ControlNews> SettleControl(Transaction& transaction, BodyId id, Tick now);
// Whether SettleControl has anything to do.
bool MustSettleControl(const GameWorld& world, BodyId id, Tick now);

}  // namespace tessera::game
