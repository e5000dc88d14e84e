// Suite `speed`: many bodies, tessera against stock Bullet.
//
// Both run in one process and one thread, turn about by chunks of steps (A B B A ...), so that whatever else the
// machine does meets both alike. `time_ratio` is the median over chunks of tessera's CPU time for a chunk over
// Bullet's, with its 10th and 90th percentile; `time_ratio_total` that of the whole run. Figures of what the very same
// run came to stand beside it: penetration over the last fifth, drift, bodies that fell through. `counts` is 1 if
// none of tessera's is worse than Bullet's. Several threads, and the peers of this year: bench/speed_threads.h.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

// Quick: smaller scenes, under 40 s; with the peers of this year three times that.
absl::Status RunSpeed(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
