// ProcessMetrics: what a process takes from its host, read from /proc when asked.
//
// The dissertation's memory list, virtual and physical: used by the process, usable, total. "Virtual" on the host is
// memory plus swap; "usable" is what the kernel could hand out without swapping more (MemAvailable), not what is
// unused. A figure that /proc does not give is 0. Thread rule: any thread; nothing is kept between calls.
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
  std::uint64_t max_fds = 0;  // the soft limit
};

MemoryReading ReadMemory();
ProcessReading ReadProcess();

// The two halves of ReadMemory: /proc/self/statm (in pages of `page_bytes`) and /proc/meminfo, as text.
void ParseStatm(const std::string& statm, std::uint64_t page_bytes, MemoryReading& reading);
void ParseMeminfo(const std::string& meminfo, MemoryReading& reading);

// The readings as metrics, under the names that Prometheus gives to such readings of every program, and the release;
// docs/metrics.md lists them. MetricsServer includes it by itself.
class ProcessMetrics : public prometheus::Collectable {
 public:
  std::vector<prometheus::MetricFamily> Collect() const override;
};

}  // namespace tessera::telemetry
