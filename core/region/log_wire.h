// The bytes of one body's state in the log: its words less those that both ends predict, as many bytes of each as it
// takes. Behind log_write.cpp and log_read.cpp.
//
// Bit patterns are subtracted as whole numbers, so every value, minus zero and NaN too, comes out as it went in. What
// does not change costs nothing; of what changes a little, the high bytes. Thread rule: free functions on values.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/world/scene.h"

namespace tessera::region {

// Bytes of one state at most: a byte of groups, a nibble a word, 7 words of 8 bytes and 10 of 4.
inline constexpr std::size_t kMaxStateBytes = 1 + 9 + 7 * 8 + 10 * 4;

// Writes at `out`, which has room for kMaxStateBytes + 8, and returns the end. `base`: what the other end has; null:
// nothing.
std::uint8_t* PackState(std::uint8_t* out, const BodyState& state, const BodyState* base, double tick_s);
// Reads what PackState wrote against the same base and returns the bytes read; 0 if they end early or are malformed.
std::size_t UnpackState(std::span<const std::uint8_t> in, const BodyState* base, double tick_s, BodyState& state);

// Checksum of a message that is stored or sent: finds any damage within 8 bytes, and other damage but for chance,
// 2^-64.
std::uint64_t LogChecksum(std::span<const std::uint8_t> bytes);

}  // namespace tessera::region
