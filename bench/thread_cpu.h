// CPU time of the calling thread, in seconds: what other threads and programs do meanwhile does not count. Only
// differences mean anything.
#pragma once

#include <ctime>

namespace tessera::bench {

inline double ThreadCpuSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

}  // namespace tessera::bench
