// CountInstructions: how many instructions a program executes in user space, counted by valgrind, which needs no
// counters of the processor. The same program with the same input gives the same count, but for what clocks decide.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::bench {

// The instructions that count.
struct Counted {
  enum class Where : std::uint8_t { kEverywhere, kInside, kOutside };
  Where where = Where::kEverywhere;
  // Name of a function with its namespaces; `*` stands for anything, as in "tessera::physics::World::Step(*". It is
  // never inlined, and what it calls is inside.
  std::string function;
};

// Runs `command` (program and arguments) to its end. Errors: FAILED_PRECONDITION (no valgrind, or a program that does
// not end well under it, with what it said), DATA_LOSS (a profile without a count).
absl::StatusOr<std::uint64_t> CountInstructions(const std::vector<std::string>& command, const Counted& counted = {});

}  // namespace tessera::bench
