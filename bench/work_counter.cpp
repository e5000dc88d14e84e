#include "bench/work_counter.h"

#include <linux/perf_event.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>

#include "bench/engine.h"
#include "bench/thread_cpu.h"

namespace tessera::bench {

WorkCounter::WorkCounter() {
  perf_event_attr what;
  std::memset(&what, 0, sizeof(what));
  what.size = sizeof(what);
  what.type = PERF_TYPE_HARDWARE;
  what.config = PERF_COUNT_HW_INSTRUCTIONS;
  what.exclude_kernel = 1;
  what.exclude_hv = 1;
  file_ = static_cast<int>(syscall(SYS_perf_event_open, &what, 0, -1, -1, 0));
}

WorkCounter::~WorkCounter() {
  if (file_ >= 0) close(file_);
}

double WorkCounter::Now() const {
  std::uint64_t count = 0;
  if (file_ >= 0 && read(file_, &count, sizeof(count)) == sizeof(count)) return static_cast<double>(count);
  return ThreadCpuSeconds();
}

}  // namespace tessera::bench
