// GameValue: a value that game code gives away and gets back later: in a timer, in a message.
//
//   absl::StatusOr<std::vector<std::uint8_t>> bytes = EncodeFields(fields);   // as a record keeps them
//
// Thread rule: plain values.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "core/game/settings.h"
#include "core/world/ids.h"
#include "core/world/math.h"
#include "core/world/properties.h"
#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

using GameValue = std::variant<bool, std::int64_t, double, std::string, Vec3d, BodyId, PlayerNumber>;
using GameFields = std::vector<std::pair<std::string, GameValue>>;

// Errors: INVALID_ARGUMENT "values.speed: is not finite", "values: names do not ascend", "values.to: a list cannot be
// kept"; RESOURCE_EXHAUSTED "values: take 300 bytes, more than 256".
absl::StatusOr<GameFields> FieldsFrom(const tessera_game_value& value);

// The same fields give the same bytes, at most `limit`, which is no more than kMaxMessageBytes.
absl::StatusOr<std::vector<std::uint8_t>> EncodeFields(const GameFields& fields, std::size_t limit = kMaxFieldBytes);
// INVALID_ARGUMENT: "values: truncated", "... of an unknown type", "... names do not ascend", "... is not finite".
absl::StatusOr<GameFields> DecodeFields(std::span<const std::uint8_t> bytes, std::size_t limit = kMaxFieldBytes);

// Nothing for types that are not kept.
std::optional<GameValue> FromInterface(const tessera_game_value& value);
// A value for the property `def`: of its type where that can be, else of its own; nothing for types that no property
// has.
std::optional<PropertyValue> PropertyFrom(const tessera_game_value& value, const PropertyDef& def);
// `value` as the interface has it; it points into `value`.
tessera_game_value ToInterface(const GameValue& value);

}  // namespace tessera::game
