// The queries of the table, world.ray to world.overlap: their options, and their hits as a game sees them.
#pragma once

#include <span>

#include "absl/status/statusor.h"
#include "core/game/calls.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

// Bounds of what a game may ask. A longer way or a wider shape meets more bodies than a callback can pay for.
inline constexpr double kMaxQueryLength_m = 10'000, kMaxQueryExtent_m = 1'000, kMinQueryExtent_m = 1e-3;
inline constexpr std::int64_t kMaxQueryHits = 64, kUsualQueryHits = 16;

// Carries out the query `function`, whose arguments have the types of the table. The call pays for its work, and its
// result points into the call.
absl::StatusOr<tessera_game_value> CallQuery(tessera_game_call& call, const Function& function,
                                             std::span<const tessera_game_value> arguments);

// Hits for the interface; they point into `values` and `fields`.
tessera_game_value HitsValue(const std::vector<QueryHit>& hits, double length_m,
                             std::vector<tessera_game_value>& values, std::vector<tessera_game_field>& fields);

}  // namespace tessera::game
