// The suite `games`: what game code costs beside the physics, and whether what it makes is there once.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunGames(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
