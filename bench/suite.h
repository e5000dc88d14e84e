// SuiteOptions: the request to a suite of the benchmarks.
#pragma once

#include <string>

namespace tessera::bench {

struct SuiteOptions {
  bool quick = false;  // a smoke test of the suite: fewer sizes, seeds and steps, under a minute
  std::string only;    // run only what has this in its name; all if empty
  std::string part{};  // for `lean`: run this side of each pair alone, and measure nothing
  unsigned runs = 0;   // repetitions of each measurement; 0: the suite's own number
  double minutes = 0;  // for `soak`: how long it runs; 0: an hour, or two minutes if quick
  std::string csv;     // where the figures go; plots go beside it. None if empty
};

}  // namespace tessera::bench
