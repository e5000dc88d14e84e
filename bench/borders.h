// Suite `borders`: what many regions come to against one world, and what that costs.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunBorders(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
