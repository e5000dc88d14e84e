// The dissertation's evaluation, repeated on real processes: layouts of 2 and 3 regions, 1 and 100 objects a region,
// two clients.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"

namespace tessera::bench {

struct DissertationOptions {
  double seconds = 20;  // measured for each layout, after the world has run for a second
};

// Its metrics: of each region physics update, prediction, full and delta snapshot broadcast time and memory; of each
// client frame, network and update time. Rows of several regions or clients are their mean.
absl::Status RunDissertation(const DissertationOptions& options, Report& report);

}  // namespace tessera::bench
