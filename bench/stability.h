// The suite `stability`: what must stand, hold, roll, swing, rebound or be refused, and by how much it does not.
//
// Tessera at its one committed setting (EngineConfig{}, 60 Hz unless a config says otherwise, nothing sleeps), stock
// Bullet beside it where that is cheap. Every scene also has its `cpu_us_per_tick`.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunStability(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
