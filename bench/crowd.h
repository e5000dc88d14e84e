// The suite `crowd`: all players and bodies of a world in one spot, against the same ones spread over it.
//
//   crowd_cpu_ratio     CPU time a tick of the busiest region, in a crowd against spread out
//   *_step_ms, *_write_ms   its parts: the region's step, and snapshots for all clients
//   client_budget_share     bytes a second of the client that gets most, of what the scene allows it
//   near_rate_hz            how often a moving body within 10 m of the own one comes
//
// Configs are one region, four of an even grid (the spot is within one of them), four that are balanced, and one region
// of two threads, by the clock.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunCrowd(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
