// The constants that both ends of the log agree on beside the states. Behind log_write.cpp and log_read.cpp;
// docs/protocol.md describes the bytes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::region::log_format {

inline constexpr std::uint8_t kMagic[] = {'T', 'L'};
inline constexpr std::uint8_t kLogFormat = 9;
inline constexpr std::uint8_t kWhole = 1, kChanges = 2;  // kinds of message
inline constexpr std::uint8_t kTrigger = 1, kBegun = 2;  // flags of a pair
inline constexpr std::size_t kChecksumBytes = 8;         // at the end

}  // namespace tessera::region::log_format
