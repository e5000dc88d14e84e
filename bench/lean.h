// Suite `lean`: what a scene does not need, it does not pay for.
//
// Each line is a pair of runs that differ in one thing, which is present in one and of no use to the rest of it: boxes
// that sleep, a border nobody is near, one body among many that needs what the others do not. `lean_cost_ratio` is the
// median over alternating units of work with it to without it; at most 1.01 holds. Its p10 and p90 give the spread,
// `lean_cost_ratio_error` the standard error of that median: what is finer cannot be seen. Where all bodies can be
// made to need the thing, `needed_cost_ratio` says what it costs then, and so what is saved.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

// Does a piece of work that goes on where the last one ended, and says how much it was.
using WorkUnit = std::function<double()>;

struct LeanPair {
  WorkUnit without, with;
  WorkUnit needed = nullptr;  // where there is such a thing
};

struct LeanLine {
  std::string name;
  std::string counted;             // unit of the work: "instructions", "cpu_time", "bytes"
  std::function<LeanPair()> make;  // afresh, from the same start each time
};

std::vector<LeanLine> PhysicsLines();
std::vector<LeanLine> RegionLines();

absl::Status RunLean(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
