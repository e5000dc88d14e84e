// News of a movement: by which function of the game (tessera/movement.h) a player's body is moved, and the private
// state that the function left, for the client that predicts it. The body's region sends them to that player with each
// snapshot, and to nobody where no game moves the body.
//
// One that is lost costs little: the client goes on by the state that it has come to itself.
//
// Layout: kind (1) | format (1) | tick | name, a block | body | version | state, a block; numbers as varints. Thread
// rule: free functions; any thread.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/ids.h"
#include "core/world/movement.h"

namespace tessera::replication {

inline constexpr std::uint8_t kMovementNewsFormat = 1;
// Two bytes, three varints and two blocks: what a reader looks at, at most.
inline constexpr std::size_t kMaxMovementNewsBytes =
    2 + 3 * 10 + 1 + TESSERA_MAX_MOVEMENT_NAME + 1 + TESSERA_MAX_MOVEMENT_STATE;

struct MovementNews {
  Tick tick;            // the snapshot's
  std::string name;     // the movement's
  MovementState state;  // as it was for the input that acted in the step to `tick`; its body and version are the news'
  friend bool operator==(const MovementNews&, const MovementNews&) = default;
};

std::vector<std::uint8_t> EncodeMovementNews(const MovementNews& news);
// Errors: INVALID_ARGUMENT "movement.tick: truncated", "movement: format 2, expected 1", ...
absl::StatusOr<MovementNews> DecodeMovementNews(std::span<const std::uint8_t> datagram);

}  // namespace tessera::replication
