// Correction: the own body was shown elsewhere than the server then had it, and why, as far as a client can know.
//
// A client sees how many of its inputs the server applied in how many ticks, who owned the body, and which bodies it
// touched in its own prediction. Of several reasons the first of Cause holds. Thread rule: a value.
#pragma once

#include <cstdint>
#include <string>

#include "core/world/ids.h"

namespace tessera::client {

struct Correction {
  enum class Cause : std::uint8_t {
    kOwner,    // another region moves the body: `from` did before
    kInputs,   // inputs acted at other ticks than was thought: `late` more than thought, or earlier if negative
    kMeeting,  // it touched the body `met`, which is simulated elsewhere, by what is known there
    kUnknown,  // a body or a force that is not known here, or a game's doing
  };
  Tick tick;
  std::uint32_t last_input = 0;  // the newest that had acted by then
  double off_m = 0;
  Cause cause = Cause::kUnknown;
  RegionId from{};
  std::int64_t late = 0;  // ticks
  BodyId met{};
};

// "0.12 m: 2 inputs acted late".
std::string Describe(const Correction& correction);

}  // namespace tessera::client
