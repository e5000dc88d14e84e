// Named values of a game as the API has them, and as a game keeps them. Thread rule: free functions on values.
#pragma once

#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "core/game/value.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

using GameFieldList = google::protobuf::RepeatedPtrField<v1::GameField>;

// As a game keeps them. INVALID_ARGUMENT: "values[1]: has no value", "values[0].name: ...", "values.speed: is not
// finite", "values: take 600 bytes, more than 512".
absl::StatusOr<std::vector<std::uint8_t>> EncodeGameFields(const GameFieldList& fields);

// Nothing where the bytes are not what a game keeps.
GameFieldList DecodeGameFields(std::string_view bytes);

}  // namespace tessera::control
