// Scenes of the suite trust, and how large they are.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "bench/report.h"

namespace tessera::bench {

inline constexpr const char* kTrustEngine = "tessera";

struct TrustSize {
  std::uint32_t calls;  // an operator makes so many without an attack
  std::uint32_t import_mb, lease_requests, join_threads, joins_each;
  std::uint32_t starts;     // so many fresh clusters
  std::uint32_t creations;  // by each door
  std::uint32_t rounds;     // pairs of a quiet and a flooded span
  double span_s;
  std::uint32_t bodies, regions, evictions;
  std::uint32_t churn_joins, churn_worlds, churn_readings;  // readings: at least 2
  std::uint32_t full_players;
};

absl::Status RunAttacks(const TrustSize& size, Report& report);
absl::Status RunStart(const TrustSize& size, Report& report);
absl::Status RunCreate(const TrustSize& size, Report& report);
absl::Status RunFloodedTicks(const TrustSize& size, Report& report);
absl::Status RunEvictions(const TrustSize& size, Report& report);
absl::Status RunFull(const TrustSize& size, Report& report);
absl::Status RunChurn(const TrustSize& size, Report& report);

}  // namespace tessera::bench
