#include "control_plane/cluster/health_watch.h"

#include <algorithm>
#include <chrono>
#include <cstddef>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/cluster/liveness.h"
#include "control_plane/control_settings.h"
#include "control_plane/standbys.h"
#include "control_plane/world_terms.h"

namespace tessera::control {
namespace {

// Empty: it has a standby that holds a whole copy of it. Else why not.
std::string UncoveredBecause(const InstanceEntry& instance, const WorkerEntry& worker, std::uint32_t standby) {
  if (instance.record.map().regions_size() < 2) return "";
  if (standby == 0) return "it has no standby";
  const bool copied = std::any_of(instance.workers.begin(), instance.workers.end(), [&](const WorkerEntry& other) {
    return other.region == standby && !other.gone && HoldsCopyOf(other, worker.incarnation);
  });
  return copied && !worker.report.unprotected() ? "" : "has no whole copy";
}

bool Linked(const WorkerEntry& worker, std::uint32_t other) {
  const auto& linked = worker.report.linked_regions();
  return std::find(linked.begin(), linked.end(), other) != linked.end();
}

// A slow world steps seldom.
Steady AtLeastASlowStep(const records::Instance& record, Steady patience) {
  const double pace = PaceOf(record);
  if (pace <= 0) return patience;
  return std::max(patience, std::chrono::duration_cast<Steady>(std::chrono::duration<double>(2.5 / pace)));
}

// The region's newest tick that was reported since this control plane began; 0: none. Agents attach one by one, so its
// standby may show it first: what a copy gains was stepped.
std::uint64_t ReportedTick(const InstanceEntry& instance, const WorkerEntry& worker) {
  if (worker.reported) return worker.report.tick();
  std::uint64_t tick = 0;
  for (const WorkerEntry& other : instance.workers) {
    for (const v1::StandbyStatus& copy : other.report.standby_copies()) {
      if (copy.region() != worker.region || copy.incarnation() != worker.incarnation) continue;
      tick = std::max(tick, copy.tick());
    }
  }
  return tick;
}

std::string RegionsText(const std::vector<std::uint32_t>& regions) {
  return absl::StrCat("region", regions.size() == 1 ? " " : "s ", absl::StrJoin(regions, ", "));
}

}  // namespace

std::string HealthFaults::Text() const {
  std::vector<std::string> texts;
  std::vector<std::uint32_t> stopped = still;
  std::erase_if(stopped, [this](std::uint32_t region) { return std::ranges::find(unknown, region) != unknown.end(); });
  if (!unknown.empty()) texts.push_back(absl::StrCat("not known to step yet: ", RegionsText(unknown)));
  if (!stopped.empty()) texts.push_back(absl::StrCat("no steps are known of ", RegionsText(stopped)));
  for (const CutLink& link : cut) {
    texts.push_back(absl::StrCat("regions ", link.one, " and ", link.other, " have no link"));
  }
  texts.insert(texts.end(), uncovered.begin(), uncovered.end());
  return absl::StrJoin(texts, "; ");
}

HealthFaults HealthWatch::Look(const InstanceEntry& instance, Now now) {
  if (instance.record.state() != v1::INSTANCE_STATE_RUNNING) {
    Forget(instance.number);
    return {};
  }
  Watched& watched = watched_[instance.number];
  const Steady unseen = watched.looked_at.count() == 0 ? Steady(0) : now.steady - watched.looked_at;
  if (unseen > kOwnPause) Forgive(watched, unseen);
  const Steady passed = unseen > kOwnPause ? Steady(0) : unseen;
  watched.looked_at = now.steady;
  std::map<std::uint64_t, Region> before = std::exchange(watched.regions, {});
  HealthFaults faults;
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    if (!Counts(instance, i) && !Unheard(instance, i)) continue;
    Region& region = watched.regions[instance.workers[i].incarnation];
    const auto known = before.find(instance.workers[i].incarnation);
    region = known == before.end() ? Region{.stepped_at = now.steady} : known->second;
    LookAtRegion(instance, i, region, faults, now);
  }
  LookAtLinks(instance, watched, passed, faults, now);
  return faults;
}

void HealthWatch::Forgive(Watched& watched, Steady unseen) {
  for (auto& [incarnation, region] : watched.regions) {
    region.stepped_at += unseen;
    if (region.uncovered_since.count() != 0) region.uncovered_since += unseen;
  }
  for (auto& [pair, since] : watched.cut_since) since += unseen;
}

// Newcomers have no part in the world yet; what died, or lies on a lost host, is reported as that.
bool HealthWatch::Counts(const InstanceEntry& instance, std::size_t index) const {
  return Looks(instance, index) && instance.workers[index].report.phase() == v1::WORKER_PHASE_RUNNING;
}

// In a world that runs it ran before this control plane began, and may do so still.
bool HealthWatch::Unheard(const InstanceEntry& instance, std::size_t index) const {
  return Looks(instance, index) && !instance.workers[index].reported;
}

bool HealthWatch::Looks(const InstanceEntry& instance, std::size_t index) const {
  const HostEntry* host = HostAt(state_, instance, index);
  return !instance.workers[index].gone && host != nullptr && !host->lost &&
         !instance.record.placements(static_cast<int>(index)).joins();
}

void HealthWatch::LookAtRegion(const InstanceEntry& instance, std::size_t index, Region& region, HealthFaults& faults,
                               Now now) const {
  const records::Instance& record = instance.record;
  const WorkerEntry& worker = instance.workers[index];
  // All stand still for a failover, which is reported by itself, and in a pause.
  const bool may_stand = record.has_failover() || IsPaused(record) || worker.report.world_paused();
  const std::uint64_t tick = ReportedTick(instance, worker);
  // The first tick that is reported may have been made long ago.
  const bool steps = region.tick != 0 && tick != region.tick;
  region.stepped = region.stepped || steps;
  region.tick = tick;
  if (steps || may_stand) region.stepped_at = now.steady;
  const Steady still = now.steady - region.stepped_at;
  if (!region.stepped && still >= AtLeastASlowStep(record, kNotKnownAfter)) faults.unknown.push_back(worker.region);
  if (still > AtLeastASlowStep(record, kStillAfter)) faults.still.push_back(worker.region);
  if (!worker.reported) return;  // nothing else is known of it

  const std::uint32_t standby = StandbyOf(record, worker.region);
  const std::string why = UncoveredBecause(instance, worker, standby);
  if (why.empty()) {
    region.uncovered_since = Steady(0);
    return;
  }
  if (region.uncovered_since.count() == 0) region.uncovered_since = now.steady;
  if (now.steady - region.uncovered_since <= kStandbyPatience) return;
  faults.uncovered.push_back(
      absl::StrCat(NameOfRegion(instance, worker.region), ": ",
                   standby == 0 ? why : absl::StrCat("its standby, ", NameOfRegion(instance, standby), ", ", why)));
}

// A region that stands for want of a lease says nothing to its neighbours, whose reports do not list it then. It is
// reported as one that stands, and nothing follows about its links: that time does not count.
void HealthWatch::LookAtLinks(const InstanceEntry& instance, Watched& watched, Steady passed, HealthFaults& faults,
                              Now now) const {
  std::map<std::uint32_t, const WorkerEntry*> workers;
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    if (Counts(instance, i)) workers[instance.workers[i].region] = &instance.workers[i];
  }
  const auto before = std::exchange(watched.cut_since, {});
  for (const auto& [id, worker] : workers) {
    if (!instance.map.HasRegion(RegionId(id))) continue;
    for (const RegionId neighbor : instance.map.Neighbors(RegionId(id))) {
      const auto other = workers.find(neighbor.value());
      if (neighbor.value() < id || other == workers.end()) continue;
      if (Linked(*worker, neighbor.value()) && Linked(*other->second, id)) continue;
      const std::pair pair(id, neighbor.value());
      const auto known = before.find(pair);
      const bool stands = worker->report.paused() || other->second->report.paused();
      const Steady since = watched.cut_since[pair] =
          known == before.end() ? now.steady : known->second + (stands ? passed : Steady(0));
      if (now.steady - since > kCutAfter) faults.cut.push_back({pair.first, pair.second, since});
    }
  }
}

std::string HealthWatch::NameOfRegion(const InstanceEntry& instance, std::uint32_t region) const {
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    if (instance.workers[i].region != region || instance.workers[i].gone) continue;
    const HostEntry* host = HostAt(state_, instance, i);
    if (host != nullptr) return absl::StrCat("region ", region, " on ", host->record.name());
  }
  return absl::StrCat("region ", region);
}

}  // namespace tessera::control
