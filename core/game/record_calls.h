// Calls of game code on a record, be it a body's or the world's: its properties and timers.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/game/calls.h"
#include "core/game/record.h"
#include "core/world/properties.h"

namespace tessera::game {

// The tick at which something so many ticks from now is due.
absl::StatusOr<Tick> TicksAhead(std::string_view function, std::string_view name, Tick now, std::int64_t ticks);

// The result may point into the call. NOT_FOUND "get: no property ...".
absl::StatusOr<tessera_game_value> GetProperty(tessera_game_call& call, std::span<const PropertyDef> declared,
                                               const PropertySet& of_scene, const PropertySet& changed,
                                               std::string_view name);
// A whole number is taken for a real one where the property is real.
absl::Status SetProperty(std::span<const PropertyDef> declared, std::string_view name, const tessera_game_value& value,
                         PropertySet& properties);
// Whether SetProperty would take it, as far as that follows from the declaration.
absl::Status CheckProperty(std::span<const PropertyDef> declared, std::string_view name,
                           const tessera_game_value& value);

// Arguments of `after`: ticks, name, values. Returns the timer's number.
absl::StatusOr<std::int64_t> SetTimer(Tick now, std::span<const tessera_game_value> arguments, GameRecord& record);
// Whether there was one.
// show_to: changes which clients see the body. Error: INVALID_ARGUMENT "show_to: `who` must be ...".
absl::Status ShowTo(const Scene& scene, const BodyDef& def, std::string_view who, GameRecord& record);

bool CancelTimer(GameRecord& record, std::int64_t number);

}  // namespace tessera::game
