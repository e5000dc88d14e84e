// Checks of the suite failover beside deaths: growth under load, a hot spot, a cold restore, and the cost of standbys.
#pragma once

#include "absl/status/status.h"
#include "bench/failover_stage.h"
#include "bench/report.h"

namespace tessera::bench {

// From two regions to four and back, `scale_rounds` times in one world.
absl::Status RunScale(const FailoverSize& size, Report& report);

// Four of five bodies run into one corner of a world that balances its regions.
absl::Status RunHotSpot(const FailoverSize& size, Report& report);

// A checkpoint of one cluster is started by another that has just come up: from the call until all regions step.
absl::Status RunRestore(const FailoverSize& size, Report& report);

// One region's ticks on this thread, with and without the log that it writes and its standby takes in; ticks of both
// kinds in turn. No sockets.
absl::Status RunStandby(const FailoverSize& size, Report& report);

}  // namespace tessera::bench
