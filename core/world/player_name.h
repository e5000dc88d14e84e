// The name that a player gives itself: shown to others, so it is checked wherever it comes in.
//
//   if (absl::Status status = CheckPlayerName(request.player_name()); !status.ok()) return status;
//
// Thread rule: free functions on values.
#pragma once

#include <cstddef>
#include <string_view>

#include "absl/status/status.h"

namespace tessera {

// Enough for a name in any script; it goes with the body to each client that sees it.
inline constexpr std::size_t kMaxPlayerNameBytes = 32;

// An empty name is a name. INVALID_ARGUMENT "player_name: 40 bytes are more than 32", "... is not UTF-8", "... has a
// control character".
absl::Status CheckPlayerName(std::string_view name);

// Whether the text has no character that ends a line or steers a terminal: U+0000 to U+001F, U+007F to U+009F.
bool HasNoControls(std::string_view utf8);

}  // namespace tessera
