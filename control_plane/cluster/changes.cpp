// Planned maps: what was asked for and what follows from drains, deaths and loads. The steps are change.h's.
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/heirs.h"
#include "control_plane/orders.h"
#include "core/world/limits.h"

namespace tessera::control {
namespace {

constexpr double kReportTicks = 64;  // that a reported median is of; StepTimes in region_worker
constexpr std::chrono::nanoseconds kLongestWait = std::chrono::seconds(5);  // in a world that hardly moves

constexpr int kMaxSpread = 256;  // values an axis; more is no report of ours

bool Ascends(const google::protobuf::RepeatedField<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); }) &&
         std::is_sorted(values.begin(), values.end());
}

// Empty, as if not known, unless it is one.
RegionSpread SpreadOf(const v1::WorkerReport& report) {
  const auto &x = report.spread_x(), &z = report.spread_z();
  if (x.size() < 2 || x.size() > kMaxSpread || x.size() != z.size() || !Ascends(x) || !Ascends(z)) return {};
  return {{x.begin(), x.end()}, {z.begin(), z.end()}};
}

// Where borders are to be balanced, until the reported step times are all of the map that came into force just now.
std::chrono::nanoseconds UntilNextChange(const InstanceEntry& instance) {
  std::chrono::nanoseconds wait = kBalanceInterval;
  if (!instance.record.balance()) return wait;
  for (const WorkerEntry& worker : instance.workers) {
    if (worker.report.tick_rate_hz() <= 0) continue;  // not measured yet
    const std::chrono::duration<double> ticks(kReportTicks / worker.report.tick_rate_hz());
    if (ticks > wait) wait = std::min(std::chrono::duration_cast<std::chrono::nanoseconds>(ticks), kLongestWait);
  }
  return wait;
}

// What a region costs that owns nothing that moves, in bodies: without it the price of a body in a near-empty region is
// far too high.
constexpr double kEmptyBodies = 50;

double LoadedBodies(const v1::WorkerReport& report) {
  const std::uint64_t asleep = std::min(report.asleep(), report.owned());
  return static_cast<double>(report.owned() - asleep) + kEmptyBodies;
}

// How long a step takes by what is in the region now and what that cost of late: a machine that is busy with something
// else makes one second's step times up to twice as long as the next one's, and borders would follow.
double SmoothedStep(WorkerEntry& worker) {
  const double bodies = LoadedBodies(worker.report), cost_s = worker.report.step().p50_seconds() / bodies;
  worker.body_cost_s = worker.body_cost_s > 0 ? (worker.body_cost_s + cost_s) / 2 : cost_s;
  return worker.body_cost_s * bodies;
}

}  // namespace

absl::StatusOr<InstanceEntry*> Cluster::FindRunning(const std::string& id) {
  InstanceEntry* instance = FindInstance(id);
  if (instance == nullptr) return absl::NotFoundError(absl::StrCat("id: no instance ", OneLine(id, kMaxNameBytes)));
  if (instance->record.state() != v1::INSTANCE_STATE_RUNNING) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", instance->record.id(), " does not run"));
  }
  return instance;
}

absl::StatusOr<v1::Instance> Cluster::ScaleInstance(Moment now, const v1::ScaleInstanceRequest& request) {
  if (request.regions() < 1 || request.regions() > kMaxRegions) {
    return absl::InvalidArgumentError(absl::StrCat("regions: ", request.regions(), " is not in 1 to ", kMaxRegions));
  }
  const auto found = FindRunning(request.id());
  if (!found.ok()) return found.status();
  InstanceEntry& instance = **found;
  records::Instance next = instance.record;
  next.set_wanted_regions(request.regions());
  if (AtRest(next)) {  // else it is tried once that is over
    const auto planned = PlanChange(next, ChangeFacts(now, instance), HeardHosts(now, nullptr));
    if (!planned.ok()) return planned.status();
  }
  if (request.validate_only() || next.wanted_regions() == instance.record.wanted_regions()) return View(instance, true);
  AddEvent(next, now, absl::StrCat("scaling from ", instance.record.map().regions_size(), " to ", request.regions()));
  if (absl::Status status = StoreInstance(instance, next); !status.ok()) return status;
  instance.change_after = Steady(0);
  Changed(instance);
  Reconcile(now, instance);
  return View(instance, true);
}

absl::StatusOr<v1::Instance> Cluster::RestartWorkers(Moment now, const v1::RestartWorkersRequest& request) {
  const auto found = FindRunning(request.id());
  if (!found.ok()) return found.status();
  InstanceEntry& instance = **found;
  const bool under_way = std::any_of(instance.workers.begin(), instance.workers.end(), [&](const WorkerEntry& worker) {
    return worker.incarnation <= instance.record.replace_up_to();
  });
  if (under_way) return View(instance, true);
  records::Instance next = instance.record;
  next.set_replace_up_to(next.last_incarnation());
  if (AtRest(next)) {  // else it is tried once that is over
    const auto planned = PlanChange(next, ChangeFacts(now, instance), HeardHosts(now, nullptr));
    if (!planned.ok()) return planned.status();
  }
  if (request.validate_only()) return View(instance, true);
  if (next.wanted_regions() == 0) next.set_wanted_regions(static_cast<std::uint32_t>(next.map().regions_size()));
  AddEvent(next, now, absl::StrCat("replacing ", next.map().regions_size(), " workers one after the other"));
  if (absl::Status status = StoreInstance(instance, next); !status.ok()) return status;
  instance.change_after = Steady(0);
  Changed(instance);
  Reconcile(now, instance);
  return View(instance, true);
}

// Which regions cannot hear each other: an heir that is there, but takes nothing of its ward's log, or not in time.
// Once two are kept apart, and only then, a missing link between neighbours prolongs it.
void Cluster::NoteCuts(Moment now, InstanceEntry& instance) {
  const auto index_of = [&](std::uint32_t region) {
    const auto at = std::find_if(instance.workers.begin(), instance.workers.end(),
                                 [region](const WorkerEntry& worker) { return worker.region == region; });
    return static_cast<std::size_t>(at - instance.workers.begin());
  };
  const auto hears = [&](std::uint32_t region, std::uint32_t other) {
    const std::size_t index = index_of(region);
    if (index == instance.workers.size()) return true;
    const auto& linked = instance.workers[index].report.linked_regions();
    return std::find(linked.begin(), linked.end(), other) != linked.end();
  };
  for (WorkerEntry& worker : instance.workers) {
    const std::uint32_t heir = HeirOf(instance.record, worker.region);
    const std::size_t index = index_of(heir);
    const bool waits = worker.report.phase() == v1::WORKER_PHASE_RUNNING && worker.report.unprotected() && heir != 0 &&
                       now.steady - worker.reported_at < settings_.failover_after && index < instance.workers.size() &&
                       !Silent(now, instance, index);
    if (!waits) {
      worker.unprotected_since = Steady(0);
      continue;
    }
    if (worker.unprotected_since.count() == 0) worker.unprotected_since = now.steady;
    if (now.steady - worker.unprotected_since < kHeirPatience) continue;
    worker.unprotected_since = now.steady;
    instance.cuts[std::minmax(worker.region, heir)] = now.steady + kCutKept;
    effects_.log.push_back(
        absl::StrCat("heir takes nothing instance=", instance.record.id(), " region=", worker.region, " heir=", heir));
  }
  for (auto& [pair, until] : instance.cuts) {
    const std::vector<RegionId> neighbors = instance.map.Neighbors(RegionId(pair.first));
    const bool adjoin = std::binary_search(neighbors.begin(), neighbors.end(), RegionId(pair.second));
    if (now.steady >= until && adjoin && !hears(pair.first, pair.second)) until = now.steady + kCutKept;
  }
  std::erase_if(instance.cuts, [&](const auto& entry) { return now.steady >= entry.second; });
}

std::vector<RegionFacts> Cluster::ChangeFacts(Moment now, const InstanceEntry& instance) const {
  std::vector<RegionFacts> facts;
  facts.reserve(instance.workers.size());
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    const HostEntry* host = HostAt(instance, i);
    const v1::WorkerReport& report = worker.report;
    const double age_s = std::chrono::duration<double>(now.steady - worker.reported_at).count();
    RegionFacts& region = facts.emplace_back();
    region.region = worker.region;
    region.incarnation = worker.incarnation;
    region.host_id = instance.record.placements(static_cast<int>(i)).host_id();
    region.host_draining = host != nullptr && host->record.draining();
    region.newcomer = instance.record.placements(static_cast<int>(i)).joins();
    region.bound = worker.bound();
    region.running = report.phase() == v1::WORKER_PHASE_RUNNING;
    region.tick = report.tick();
    if (report.tick() > 0) region.tick += static_cast<std::uint64_t>(age_s * instance.record.tick_rate_hz());
    region.map_version = report.map_version();
    region.planned_version = report.planned_version();
    region.refused_version = report.refused_version();
    region.bodies_outside = report.bodies_outside();
    for (const auto& [pair, until] : instance.cuts) {
      if (pair.first == worker.region) region.cut_from.push_back(pair.second);
      if (pair.second == worker.region) region.cut_from.push_back(pair.first);
    }
    std::sort(region.cut_from.begin(), region.cut_from.end());
    region.step_s = report.step().p50_seconds();
    region.spread = SpreadOf(report);
  }
  return facts;
}

std::optional<records::Instance> Cluster::NextChange(Moment now, InstanceEntry& instance) {
  const records::Instance& record = instance.record;
  if (record.has_failover() || !instance.restore_wanted.empty()) return std::nullopt;
  NoteCuts(now, instance);
  std::vector<RegionFacts> facts = ChangeFacts(now, instance);
  if (auto next = StepPlan(record, facts)) {
    if (AtRest(*next)) {
      instance.change_after = now.steady + UntilNextChange(instance);
      AddEvent(*next, now,
               absl::StrCat("map ", next->map().version(), " in force: ", next->map().regions_size(), " regions"));
    }
    return next;
  }
  const bool all_run = AllRunByMap(instance);
  if (!AtRest(record) || !all_run || now.steady < instance.change_after) return std::nullopt;
  for (std::size_t i = 0; i < facts.size(); ++i) facts[i].step_s = SmoothedStep(instance.workers[i]);
  auto planned = PlanChange(record, facts, HeardHosts(now, nullptr));
  if (!planned.ok()) {
    instance.change_after = now.steady + kChangeRetry;
    NoteTrouble(instance, "change cannot be made for now", planned.status());
    return std::nullopt;
  }
  if (!*planned) {
    instance.change_after = now.steady + kBalanceInterval;
    return std::nullopt;
  }
  return *std::move(*planned);
}

}  // namespace tessera::control
