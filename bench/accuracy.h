// The suite `accuracy`: error against CPU time, each engine at many step lengths and solver settings.
//
// For every trial: `error` (the scene's own measure, 0 in truth), its parts, and `cpu_us_per_tick`. For every scene:
// `front_dominated`, 1 if at every error that both reach Tessera takes less CPU time than Bullet and than ODE. What
// holds for one committed setting has the config `hz=60`. With a CSV, a plot of each scene beside it.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunAccuracy(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
