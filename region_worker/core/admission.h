// Whether a player that has proven its credential may enter.
#pragma once

#include <cstdint>

namespace tessera::worker {

enum class Admission : std::uint8_t { kWelcome, kNotYet, kLeft, kReplaced };

}  // namespace tessera::worker
