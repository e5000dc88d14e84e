// The functions of bodies: what is read of one that is here, what is changed of one that the region owns, and what is
// sent to the owner of another one.
//
// Thread rule: as calls.h.
#pragma once

#include "absl/status/statusor.h"
#include "core/game/arguments.h"
#include "core/game/calls.h"

namespace tessera::game {

// Functions of a body without arguments that cannot fail where the body is here: those that games call most. False, and
// no result, for all others.
bool ReadAtOnce(const tessera_game_call& call, std::uint32_t function, BodyId id, tessera_game_value& result);

// `arguments`, after the body, have the types of the table.
absl::StatusOr<tessera_game_value> CallBody(tessera_game_call& call, const Function& function, BodyId id,
                                            CallArguments arguments);

}  // namespace tessera::game
