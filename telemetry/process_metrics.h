// ProcessMetrics: what a process takes from its host, read from /proc when asked.
//
// The dissertation's memory list, virtual and physical: used by the process, usable, total. "Virtual" on the host is
// memory plus swap; "usable" is what the kernel could hand out without swapping more (MemAvailable), not what is
// unused. Beside it stands what others take from this process: a processor, memory or a disk that it waits for. A
// figure that /proc does not give is 0. Thread rule: any thread; nothing is kept between calls.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "prometheus/collectable.h"
#include "prometheus/metric_family.h"

namespace tessera::telemetry {

struct MemoryReading {
  std::uint64_t process_virtual_bytes = 0;
  std::uint64_t process_physical_bytes = 0;  // resident set
  std::uint64_t host_virtual_available_bytes = 0;
  std::uint64_t host_virtual_total_bytes = 0;
  std::uint64_t host_physical_available_bytes = 0;
  std::uint64_t host_physical_total_bytes = 0;
};

struct ProcessReading {
  double cpu_s = 0;  // user and system, all threads
  double start_time_unix_s = 0;
  std::uint64_t open_fds = 0;
  std::uint64_t max_fds = 0;    // the soft limit
  double processor_wait_s = 0;  // in which the main thread was ready and another had its processor
};

// Seconds since the host booted.
struct HostReading {
  double steal_s = 0;  // in which the machine below a virtual one gave its processors to others; summed over processors
  double cpu_stalled_s = 0, memory_stalled_s = 0, io_stalled_s = 0;  // in which some task waited for it
};

MemoryReading ReadMemory();
ProcessReading ReadProcess();
HostReading ReadHost();

// The two halves of ReadMemory: /proc/self/statm (in pages of `page_bytes`) and /proc/meminfo, as text.
void ParseStatm(const std::string& statm, std::uint64_t page_bytes, MemoryReading& reading);
void ParseMeminfo(const std::string& meminfo, MemoryReading& reading);
// The second number of /proc/self/schedstat, which is in nanoseconds, in seconds.
double ParseProcessorWait(const std::string& schedstat);
// The eighth number of the first line of /proc/stat, of which a second has `ticks_per_second`, in seconds.
double ParseSteal(const std::string& stat, double ticks_per_second);
// "total" of the line "some" of a file of /proc/pressure, which is in microseconds, in seconds.
double ParsePressure(const std::string& pressure);

// The readings as metrics, under the names that Prometheus gives to such readings of every program, and the release;
// docs/metrics.md lists them. MetricsServer includes it by itself.
class ProcessMetrics : public prometheus::Collectable {
 public:
  std::vector<prometheus::MetricFamily> Collect() const override;
};

}  // namespace tessera::telemetry
