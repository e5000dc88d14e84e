// The scenes of the suite people; people.h says what each is. Each adds its figures to the report, and fails where
// something could not be started or ended unasked.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "bench/report.h"

namespace tessera::bench {

// How large the scenes are, and how long they are measured.
struct PeopleSize {
  std::uint32_t starts;                   // starts of a gateway
  std::uint32_t bodies, viewers, rounds;  // viewers: with the first
  double span_s;                          // length of each state in each round
  std::uint32_t slow_viewers, slow_rounds;
  double slow_span_s;
  std::uint32_t kills;
  std::uint32_t players, swarm_rounds;
  double swarm_span_s;
  std::uint32_t page_rounds;
};

absl::Status RunReady(const PeopleSize& size, Report& report);
absl::Status RunViewers(const PeopleSize& size, Report& report);
absl::Status RunSlowViewers(const PeopleSize& size, Report& report);
absl::Status RunGap(const PeopleSize& size, Report& report);
absl::Status RunSwarm(const PeopleSize& size, Report& report);
absl::Status RunPage(const PeopleSize& size, Report& report);

}  // namespace tessera::bench
