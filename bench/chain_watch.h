// The chain of scene 11, swung and measured; two suites use it. Inside bench only.
#pragma once

#include "absl/status/statusor.h"
#include "bench/trial.h"

namespace tessera::bench {

struct ChainFigures {
  double gap_m = 0;  // the widest at any joint, looked at every 1/60 s for 10 s
  // Error of the last time in those 10 s at which the ball passes under the fixed end, as a share of it; 1 if it did
  // not.
  double period_error = 0;
  double cpu_us = 0;  // by tick
};

absl::StatusOr<ChainFigures> SwingChain(const Trial& trial, double ratio);

}  // namespace tessera::bench
