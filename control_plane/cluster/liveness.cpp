#include "control_plane/cluster/liveness.h"

#include <algorithm>
#include <chrono>

#include "control_plane/world_terms.h"

namespace tessera::control {

Steady LastSignOf(const ClusterState& state, const InstanceEntry& instance, std::size_t index) {
  const HostEntry* host = HostAt(state, instance, index);
  return host == nullptr ? Steady(0) : std::max(host->last_heard, instance.workers[index].witnessed_at);
}

bool Silent(const ClusterState& state, const InstanceEntry& instance, std::size_t index, Steady after, Now now) {
  return HostAt(state, instance, index) == nullptr || now.steady - LastSignOf(state, instance, index) > after;
}

bool AllRunByMap(const InstanceEntry& instance) {
  return std::all_of(instance.workers.begin(), instance.workers.end(), [&](const WorkerEntry& worker) {
    return worker.report.phase() == v1::WORKER_PHASE_RUNNING &&
           worker.report.map_version() >= instance.record.map().version();
  });
}

std::uint64_t TickOf(const InstanceEntry& instance, const WorkerEntry& worker, Now now) {
  const std::uint64_t reported = worker.report.tick();
  if (reported == 0) return 0;
  const double age_s = std::chrono::duration<double>(now.steady - worker.reported_at).count();
  return reported + static_cast<std::uint64_t>(age_s * PaceOf(instance.record));
}

bool HoldsCopyOf(const WorkerEntry& worker, std::uint64_t incarnation) {
  const auto& copies = worker.report.standby_copies();
  return std::any_of(copies.begin(), copies.end(),
                     [&](const v1::StandbyStatus& copy) { return copy.incarnation() == incarnation; });
}

}  // namespace tessera::control
