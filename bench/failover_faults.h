// The faults of the suite failover, and how each is injected.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "bench/failover_stage.h"

namespace tessera::bench {

struct Fault {
  std::string name;  // as in the column: "worker"
  // Strikes the world, which is well, and waits until it goes on.
  std::function<absl::Status(FailoverStage&, std::uint32_t run, FailoverOutcome&)> strike;
  std::function<void(local::RunOptions&)> prepare = {};
};

// In order of what they take; `network` is null where hosts cannot have links of their own.
std::vector<Fault> AllFaults(const FailoverSize& size, local::HostNetwork* network);

// One world, struck `size.runs` times, each time when it is well again; a new one after a run that failed. Figures are
// in the report and its file after each run.
absl::Status RunFault(const Fault& fault, const FailoverSize& size, Report& report);

}  // namespace tessera::bench
