// What a suite of the benchmarks is asked for.
#pragma once

#include <string>

namespace tessera::bench {

struct SuiteOptions {
  bool quick = false;  // a smoke test of the suite: fewer sizes, seeds and steps, under a minute
  std::string only;    // run only what has this in its name; all if empty
  unsigned runs = 0;   // of each thing that is done again and again; 0: as many as the suite has it
  std::string csv;     // where the figures go; plots go beside it. None if empty
};

}  // namespace tessera::bench
