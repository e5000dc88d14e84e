// DiskMetrics: the room on the disk that a folder lies on, asked for when somebody asks.
//
//   auto disk = std::make_shared<DiskMetrics>("/var/lib/tessera/agent");
//   server->AddCollectable(disk);     // tessera_agent_disk_available_bytes, tessera_agent_disk_size_bytes
//
// Available is what a process may still write that is not root's, as df says it. Thread rule: any thread.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "prometheus/collectable.h"
#include "prometheus/metric_family.h"

namespace tessera::telemetry {

class DiskMetrics : public prometheus::Collectable {
 public:
  explicit DiskMetrics(std::string folder) : folder_(std::move(folder)) {}
  // Nothing where the folder's disk cannot be asked.
  std::vector<prometheus::MetricFamily> Collect() const override;

 private:
  const std::string folder_;
};

}  // namespace tessera::telemetry
