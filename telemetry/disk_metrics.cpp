#include "telemetry/disk_metrics.h"

#include <sys/statvfs.h>

namespace tessera::telemetry {
namespace {

prometheus::MetricFamily DiskBytes(const char* name, const char* help, double bytes) {
  prometheus::ClientMetric metric;
  metric.gauge.value = bytes;
  return {.name = name, .help = help, .type = prometheus::MetricType::Gauge, .metric = {metric}};
}

}  // namespace

std::vector<prometheus::MetricFamily> DiskMetrics::Collect() const {
  struct statvfs disk {};
  if (statvfs(folder_.c_str(), &disk) != 0) return {};
  const auto bytes = [&](fsblkcnt_t blocks) {
    return static_cast<double>(blocks) * static_cast<double>(disk.f_frsize);
  };
  return {DiskBytes("tessera_agent_disk_available_bytes",
                    "Bytes that can still be written to the disk of the agent's state", bytes(disk.f_bavail)),
          DiskBytes("tessera_agent_disk_size_bytes", "Size of the disk of the agent's state", bytes(disk.f_blocks))};
}

}  // namespace tessera::telemetry
