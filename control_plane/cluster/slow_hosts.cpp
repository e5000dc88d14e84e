#include "control_plane/cluster/slow_hosts.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "control_plane/cluster/loaded_bodies.h"
#include "control_plane/control_settings.h"
#include "control_plane/world_terms.h"

namespace tessera::control {
namespace {

struct Cost {
  std::uint64_t incarnation = 0;
  std::string host_id;
  double step_s = 0, body_s = 0;
};

// The costs of all regions that step and have said so; empty if one has not.
std::vector<Cost> CostsOf(const InstanceEntry& instance) {
  std::vector<Cost> costs;
  costs.reserve(instance.workers.size());
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    const double step_s = worker.report.step().p50_seconds();
    if (worker.gone || worker.report.phase() != v1::WORKER_PHASE_RUNNING || !(step_s > 0)) return {};
    costs.push_back({worker.incarnation, instance.record.placements(static_cast<int>(i)).host_id(), step_s,
                     step_s / LoadedBodies(worker.report)});
  }
  return costs;
}

// The mean cost of a body on hosts other than this one; 0: there are none.
double CostElsewhere(const std::vector<Cost>& costs, const std::string& host_id) {
  double sum = 0;
  int regions = 0;
  for (const Cost& cost : costs) {
    if (cost.host_id == host_id) continue;
    sum += cost.body_s;
    ++regions;
  }
  return regions == 0 ? 0 : sum / regions;
}

}  // namespace

std::optional<SlowRegion> SlowHosts::Look(const InstanceEntry& instance, Now now) {
  const double pace = PaceOf(instance.record);
  if (instance.record.state() != v1::INSTANCE_STATE_RUNNING || pace <= 0) {
    Forget(instance.number);
    return std::nullopt;
  }
  Watched& watched = watched_[instance.number];
  std::erase_if(watched.avoided_until, [now](const auto& entry) { return now.steady >= entry.second; });
  const std::map<std::uint64_t, Steady> before = std::exchange(watched.slow_since, {});
  const std::vector<Cost> costs = CostsOf(instance);
  std::optional<SlowRegion> worst;
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const double elsewhere = CostElsewhere(costs, costs[i].host_id);
    if (costs[i].step_s <= 1 / pace || elsewhere <= 0 || costs[i].body_s < kSlowHostCost * elsewhere) continue;
    const auto known = before.find(costs[i].incarnation);
    const Steady since = known == before.end() ? now.steady : known->second;
    watched.slow_since[costs[i].incarnation] = since;
    const double ratio = costs[i].body_s / elsewhere;
    if (now.steady - since < kSlowHostAfter || (worst && worst->cost_ratio >= ratio)) continue;
    worst = SlowRegion{instance.workers[i].region, costs[i].host_id, costs[i].step_s, 1 / pace, ratio};
  }
  return watched.avoided_until.empty() ? worst : std::nullopt;
}

void SlowHosts::NoteMoved(std::uint64_t number, const SlowRegion& moved, Now now) {
  watched_[number].avoided_until[moved.host_id] = now.steady + kSlowHostInterval;
}

bool SlowHosts::Avoids(std::uint64_t number, const std::string& host_id, Now now) const {
  const auto watched = watched_.find(number);
  if (watched == watched_.end()) return false;
  const auto avoided = watched->second.avoided_until.find(host_id);
  return avoided != watched->second.avoided_until.end() && now.steady < avoided->second;
}

std::string Describe(const SlowRegion& slow, const std::string& host_name) {
  return absl::StrFormat(
      "region %d on %s: %.0f ms a step of %.0f ms, and a body costs %.1f times what it does elsewhere", slow.region,
      host_name, slow.step_s * 1e3, slow.tick_s * 1e3, slow.cost_ratio);
}

}  // namespace tessera::control
