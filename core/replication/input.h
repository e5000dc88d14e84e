// Input messages: what a client asks for its own body, with the acknowledgement of the snapshots it has.
//
// Datagrams get lost, so each carries the last few inputs again; the region tells copies apart by their numbers
// (core/region/region_players.h). A message sent for the acknowledgement alone has no inputs. The player is not on the
// wire: the receiver knows it from the connection.
//
// Layout, little-endian: kind (1) | ack length (1) | ack | count (1) | per input: number, body, target tick as varints,
// then the fields from force to
// buttons (core/world/player_input.h). Thread rule: free functions; any thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/player_input.h"

namespace tessera::replication {

struct InputMessage {
  std::vector<std::uint8_t> ack;    // for SnapshotSender::Acknowledge
  std::vector<PlayerInput> inputs;  // ascending by number
};

// Inputs in one message: three survive two losses in a row; more than these cost without helping.
inline constexpr std::size_t kMaxInputs = 8;
inline constexpr std::size_t kMaxInputAckBytes = 64;

// Requires at most kMaxInputs and kMaxInputAckBytes; at most 600 bytes.
std::vector<std::uint8_t> EncodeInput(const InputMessage& message);
// Errors: INVALID_ARGUMENT "input: truncated", "input: inputs[1].force_n is not finite", "input: inputs[1].number does
// not ascend", ...
absl::StatusOr<InputMessage> DecodeInput(std::span<const std::uint8_t> datagram);

}  // namespace tessera::replication
