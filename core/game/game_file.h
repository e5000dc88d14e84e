// GameFile: the source of a game, as it travels from an operator through the control plane and the agents to workers.
//
//   if (absl::Status status = CheckGameFile(file); !status.ok()) return status;    // where it comes in
//   GameHash(file.bytes)                                                           // by which it is kept and asked for
//
// Thread rule: plain values and free functions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"

struct tessera_movement;  // tessera/movement.h

namespace tessera::game {

// Bytes of a game file: what the Lua host takes. Every message that carries one is bounded by it.
inline constexpr std::size_t kMaxGameFileBytes = std::size_t{1} << 20;
// Bytes of its name, which begins each of its errors.
inline constexpr std::size_t kMaxGameNameBytes = 64;

struct GameFile {
  std::string name;  // as errors shall name it
  std::string bytes;
  // A movement that was given beside the file, for a game that has none of its own: how players' inputs move bodies;
  // null: as the scene says. It outlives all that is loaded of the file.
  const tessera_movement* movement = nullptr;
};

// INVALID_ARGUMENT: "name: must be 1 to 64 bytes of UTF-8 without control characters", "content: is empty", "content:
// has 2097152 bytes, more than 1048576".
absl::Status CheckGameFile(const GameFile& file);

// SHA-256 of the content, in hexadecimal digits.
std::string GameHash(std::string_view bytes);

// GameHost::Load's seed: the same in all regions of an instance and in all their lives, another one in each instance.
std::uint64_t GameSeed(std::string_view instance_id);

}  // namespace tessera::game
