// The suite soak: an hour of a world at full load, in which it scales, workers die, players come and go, checkpoints
// are written, properties are set and a game makes bodies, in turns that are drawn from a seed. Memory, descriptors,
// threads and times of a step must stay as they are. `--minutes` says how long.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

// CANCELLED, with the figures until then in the report, when SIGINT or SIGTERM asked for the end.
absl::Status RunSoak(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
