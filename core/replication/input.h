// Input messages: what a client asks for its own body, with the acknowledgement of the snapshots it has.
//
// Datagrams get lost, so each carries the last few inputs again; the region takes those whose number it has not seen.
// Sent for the acknowledgement alone, it has no inputs.
//
// Layout, little-endian: kind (1) | ack length (1) | ack | count (1) | per input: number, body, target tick as varints,
// then force and torque as six floats. Thread rule: free functions; any thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera::replication {

struct InputCommand {
  std::uint32_t number = 0;  // from 1, counts up by one with each input of this client
  BodyId body;
  Tick target;               // the tick for which the client means it; 0: as soon as it arrives
  Vec3f force_n, torque_nm;  // world frame
  friend bool operator==(const InputCommand&, const InputCommand&) = default;
};

struct InputMessage {
  std::vector<std::uint8_t> ack;     // for SnapshotSender::Acknowledge
  std::vector<InputCommand> inputs;  // ascending by number
};

// Inputs in one message: three survive two losses in a row; more than these cost without helping.
inline constexpr std::size_t kMaxInputs = 8;
inline constexpr std::size_t kMaxInputAckBytes = 64;

// Requires at most kMaxInputs and kMaxInputAckBytes; at most 400 bytes.
std::vector<std::uint8_t> EncodeInput(const InputMessage& message);
// Errors: INVALID_ARGUMENT "input: truncated", "input: inputs[1].force_n is not finite", "input: inputs[1].number does
// not ascend", ...
absl::StatusOr<InputMessage> DecodeInput(std::span<const std::uint8_t> datagram);

}  // namespace tessera::replication
