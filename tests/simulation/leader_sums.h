// LeaderSums: what came of many runs of leader_scenario.h, for a person and as a table.
//
// Thread rule: one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <ostream>
#include <vector>

#include "tests/simulation/leader_scenario.h"

namespace tessera::simulation {

struct LeaderSums {
  std::uint64_t runs = 0, failed = 0, steps = 0, takeovers = 0, elections = 0;
  std::uint64_t acknowledged = 0, lost_changes = 0, two_owners = 0, lies = 0, ended = 0, lost_bodies = 0;
  std::array<std::uint64_t, kLeaderFaultKinds> faults{};
  std::vector<Micros> gaps;  // in which nobody led
  Micros stood = 0;          // the longest time in which a world did not step

  void Add(const LeaderOutcome& outcome);
  // A quantile of the gaps, milliseconds; 0: there is none. `share`: 0.5 is the median, 1 the worst.
  std::uint64_t GapMs(double share) const;
  void Print(std::ostream& out) const;
  // Lines without a header, in the form of the benchmarks.
  void WriteCsv(std::ostream& out) const;
};

}  // namespace tessera::simulation
