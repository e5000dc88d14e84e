// Messages as game code sends them, the functions of the world's own record, and functions of bodies that another
// region owns: those are sent to it, and carried out there.
//
// A message goes with a record: that of the body that the callback is about. Where that body does not move, and so has
// none, it goes with the other one that the callback names; where the callback is one of the world, with the world's.
#pragma once

#include <deque>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/game/calls.h"
#include "core/game/value.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

// send of bodies, and send and publish of the world with kInstanceBody as the target. Arguments: name, values.
absl::StatusOr<tessera_game_value> CallSend(tessera_game_call& call, const Function& function, BodyId target,
                                            std::span<const tessera_game_value> arguments);
// get, set, after, cancel, send, publish and is_own of the world.
absl::StatusOr<tessera_game_value> CallInstance(tessera_game_call& call, const Function& function,
                                                std::span<const tessera_game_value> arguments);

// The scene's definition of a body that may be in another region, or nothing for an id that nobody gave.
const BodyDef* DefinitionOf(const Scene& scene, BodyId id);

// Sends a message that goes with the record of whom the callback is about. The target moves.
absl::Status SendFrom(tessera_game_call& call, const Function& function, BodyId target, Message message);

// The same for a message that goes with the record of `carrier`, which the region owns, and is said by it.
absl::Status SendAs(tessera_game_call& call, const Function& function, BodyId carrier, BodyId target, Message message);

// Whether this function of bodies may be called for one of another region, to be carried out there.
bool IsVerb(std::uint32_t function);
// Sends it. The arguments, after the body, have the types of the table.
absl::StatusOr<tessera_game_value> SendVerb(tessera_game_call& call, const Function& function, BodyId target,
                                            std::span<const tessera_game_value> arguments);

// Holds what a verb was called with, the body first.
struct VerbArguments {
  std::vector<tessera_game_value> values;  // they point into what is below
  std::unique_ptr<GameFields> kept;
  std::vector<tessera_game_field> fields;
  std::deque<std::string> texts;
  std::deque<std::vector<tessera_game_field>> tables;
};
// INVALID_ARGUMENT: what came in the message is not what SendVerb wrote.
absl::StatusOr<VerbArguments> VerbArgumentsFrom(BodyId target, const Message& message);

}  // namespace tessera::game
