// Command messages: what a client asks of the game, and which of the game's events it has.
//
// Commands are numbered, from 1 on in the life of a player. Each datagram repeats those that the region has not taken
// for good yet, as many as fit, beginning with the lowest; `base` is the number of that one, so a region knows that
// none below it comes any more. The player is not on the wire: the receiver knows it from the connection.
//
// Layout, little-endian: kind (1) | last event | base | count | per command: length, bytes, shown at, with input;
// numbers as varints, the commands have the numbers from base on. Thread rule: free functions; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::replication {

// One with its header fits the smallest datagram that snapshots use.
inline constexpr std::size_t kMaxCommandBytes = 1024;
inline constexpr std::size_t kMaxCommandDatagramBytes = 1148;
inline constexpr std::size_t kMaxCommandsInDatagram = 32;

struct Command {
  std::string_view bytes;
  std::uint64_t shown_at = 0;  // as PlayerInput::shown_at, when the command was given
  // The number of the input that it goes with: the client shows already what the game is to make by the command. 0:
  // with none.
  std::uint32_t with_input = 0;
  // NOLINTNEXTLINE(google-explicit-constructor): most commands are nothing but their bytes
  Command(std::string_view text, std::uint64_t shown = 0, std::uint32_t input = 0)
      : bytes(text), shown_at(shown), with_input(input) {}
  Command(const std::string& text) : bytes(text) {}  // NOLINT(google-explicit-constructor)
  Command(const char* text) : bytes(text) {}         // NOLINT(google-explicit-constructor)
  friend bool operator==(const Command&, const Command&) = default;
};

struct CommandMessage {
  std::uint32_t last_event = 0;  // all events up to this number are here
  std::uint32_t base = 0;        // number of the first of `commands`
  std::vector<Command> commands{};
};

// How many of these commands, from the first on, fit one datagram.
std::size_t CommandsThatFit(std::span<const Command> commands);
// Requires commands that fit.
std::vector<std::uint8_t> EncodeCommands(const CommandMessage& message);
// The result points into the datagram. Errors: INVALID_ARGUMENT "commands: truncated", "commands: 2048 bytes are more
// than 1024", "commands: number is out of range", ...
absl::StatusOr<CommandMessage> DecodeCommands(std::span<const std::uint8_t> datagram);

}  // namespace tessera::replication
