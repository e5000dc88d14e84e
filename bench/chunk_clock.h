// ChunkClock: times some steps of an engine, and knows whether anything else on the machine made them longer.
//
// By the clock, steps of several threads take longer than they are whenever one of the threads is ready and has no
// processor. Linux counts that for each thread (/proc/self/task/*/schedstat).
//
//   const ChunkTime time = TimeSteps(engine, 10, 1.0 / 60);
//   if (time.undisturbed) ...
//
// Thread rule: the thread that steps the engine.
#pragma once

#include "bench/engine.h"

namespace tessera::bench {

struct ChunkTime {
  double cpu_s = 0;   // the calling thread's
  double wall_s = 0;  // by the clock
  // All threads of this process had a processor whenever they were ready, but for a hundredth of the time. False too
  // where the system does not tell.
  bool undisturbed = false;
};

ChunkTime TimeSteps(Engine& engine, int steps, double dt_s);

// Time for which this process's threads were ready and had no processor, summed over those that live, s; negative where
// the system does not tell. Only differences mean anything.
double WaitedSeconds();

}  // namespace tessera::bench
