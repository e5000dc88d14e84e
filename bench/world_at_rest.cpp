#include "bench/world_at_rest.h"

#include <algorithm>
#include <map>
#include <string>

namespace tessera::bench {

bool IsAtRest(const v1::Instance& instance, std::uint32_t regions) {
  const auto wanted = static_cast<int>(regions);
  if (instance.state() != v1::INSTANCE_STATE_RUNNING || !instance.changes().empty() ||
      !instance.unprotected_regions().empty() || instance.map().regions_size() != wanted ||
      instance.region_status_size() != wanted) {
    return false;
  }
  std::map<std::uint32_t, std::string> host_of;
  for (const v1::RegionStatus& status : instance.region_status()) {
    const v1::WorkerReport& report = status.report();
    if (report.phase() != v1::WORKER_PHASE_RUNNING || report.unprotected() || report.acknowledged_tick() == 0 ||
        report.map_version() != instance.map().version()) {
      return false;
    }
    host_of[status.region()] = status.host();
  }
  return std::ranges::all_of(instance.map().regions(), [&](const v1::MapRegion& region) {
    return region.standby() != 0 && host_of[region.id()] != host_of[region.standby()];
  });
}

bool IsSpreadEvenly(const v1::Instance& instance) {
  std::map<std::string, int> on_host;
  for (const v1::RegionStatus& status : instance.region_status()) ++on_host[status.host()];
  if (on_host.empty()) return true;
  const auto [least, most] = std::ranges::minmax_element(on_host, {}, [](const auto& entry) { return entry.second; });
  return most->second <= least->second + 1;
}

}  // namespace tessera::bench
