// Workers that die while their world runs: who notices, and how the rest goes on. The steps are failover.h's.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/heirs.h"
#include "control_plane/orders.h"
#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

CutBetween CutsOf(const InstanceEntry& instance) {
  return [&instance](RegionId a, RegionId b) { return instance.cuts.contains(std::minmax(a.value(), b.value())); };
}

}  // namespace

const HostEntry* Cluster::HostAt(const InstanceEntry& instance, std::size_t index) const {
  const auto host = hosts_.find(NumberOf(instance.record.placements(static_cast<int>(index)).host_id(), "host-"));
  return host == hosts_.end() ? nullptr : &host->second;
}

HostEntry* Cluster::HostAt(const InstanceEntry& instance, std::size_t index) {
  return const_cast<HostEntry*>(std::as_const(*this).HostAt(instance, index));
}

// --- What is noticed ---

// The lease is counted from here on by us, and from when it was asked for by the worker: it stops first. Whoever is
// not, or no longer, to run gets no answer.
void Cluster::RenewLease(Moment now, SessionId session, HostEntry& host, const v1::LeaseRequest& request) {
  const auto [instance, worker] = FindWorker(host, request.identity());
  if (instance == nullptr || worker->gone || !WantsWorkers(instance->record.state())) return;
  worker->leased_at = now.steady;
  v1::LeaseRenewal renewal;
  *renewal.mutable_identity() = request.identity();
  renewal.set_number(request.number());
  renewal.set_ttl_ms(static_cast<std::uint32_t>(kLeaseTtl.count()));
  effects_.leases.emplace_back(session, std::move(renewal));
}

absl::Status Cluster::TakeInventory(Moment now, HostEntry& host, const v1::InventoryReport& report,
                                    std::set<std::uint64_t>& touched) {
  const auto [instance, worker] = FindWorker(host, report.identity());
  if (instance == nullptr || worker->gone) return absl::OkStatus();
  const auto taken =
      control::TakeInventory(instance->record, worker->region, report.inventory(), now, instance->failover);
  if (!taken.ok()) {  // the worker's fault, not its agent's: others of that host live on
    effects_.log.push_back(absl::StrCat("inventory refused instance=", instance->record.id(),
                                        " region=", worker->region, ": ", taken.status().message()));
    return absl::OkStatus();
  }
  if (*taken) touched.insert(instance->number);
  return absl::OkStatus();
}

// One that was given up for silent has ended for certain: nobody has to wait for its lease.
void Cluster::NoticeDeadExited(const v1::WorkerExited& exited, std::set<std::uint64_t>& touched) {
  InstanceEntry* instance = FindInstance(exited.identity().instance_id());
  if (instance == nullptr) return;
  for (const records::Dead& dead : instance->record.failover().dead()) {
    if (dead.incarnation() != exited.identity().incarnation()) continue;
    instance->failover.exited.insert(dead.incarnation());
    touched.insert(instance->number);
  }
}

// An heir whose copy of a region grows, or who is asked for leases while all stand still for a failover, is a witness
// that the region lives, whatever its own agent says.
void Cluster::Witness(Moment now, InstanceEntry& instance, const v1::WorkerReport& before,
                      const v1::WorkerReport& report) {
  for (const v1::StandbyStatus& standby : report.standbys()) {
    const bool grown = std::none_of(before.standbys().begin(), before.standbys().end(), [&](const auto& old) {
      return old.incarnation() == standby.incarnation() && old.tick() >= standby.tick() &&
             old.signs() >= standby.signs();
    });
    if (!grown) continue;
    for (WorkerEntry& worker : instance.workers) {
      if (worker.incarnation == standby.incarnation()) worker.witnessed_at = now.steady;
    }
  }
}

// --- Who is dead ---

bool Cluster::Silent(Moment now, const InstanceEntry& instance, std::size_t index) const {
  const HostEntry* host = HostAt(instance, index);
  const WorkerEntry& worker = instance.workers[index];
  return host == nullptr || (now.steady - host->last_heard > settings_.failover_after &&
                             now.steady - worker.witnessed_at > settings_.failover_after);
}

// Whether the heir was heard when the other had been silent for long. Where both fall silent at one time it is not
// known whom to believe, and the one whose last word is a little older may be the one that lives.
bool Cluster::Outlives(const InstanceEntry& instance, std::size_t heir, std::size_t other) const {
  const HostEntry *heirs = HostAt(instance, heir), *others = HostAt(instance, other);
  if (heirs == nullptr || others == nullptr) return heirs != nullptr;
  const Steady last_sign = std::max(others->last_heard, instance.workers[other].witnessed_at);
  return heirs->last_heard - last_sign >= settings_.failover_after / 2;
}

// Those that have ended; and those that are silent while another, whose voice we hear, has a whole copy to go on with.
// A silent one without that may well run on, and is left alone. A newcomer that is silent before its map is committed
// has nothing to lose, one that is silent thereafter has confirmed nothing that its heir lacks; all the others wait for
// either.
std::vector<Death> Cluster::Deaths(Moment now, const InstanceEntry& instance) const {
  std::vector<Death> deaths;
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    if (worker.gone) {
      deaths.push_back({worker.region, worker.incarnation, true});
    } else if (Silent(now, instance, i)) {
      const records::Placement& placement = instance.record.placements(static_cast<int>(i));
      if (placement.joins() && !instance.record.planned().committed()) {
        deaths.push_back({worker.region, worker.incarnation, false});
        continue;
      }
      for (std::size_t heir = 0; heir < instance.workers.size(); ++heir) {
        const WorkerEntry& other = instance.workers[heir];
        const bool copied =
            std::any_of(other.report.standbys().begin(), other.report.standbys().end(),
                        [&](const v1::StandbyStatus& standby) { return standby.incarnation() == worker.incarnation; });
        const bool heir_of_newcomer = placement.unprotected() && HeirOf(instance.record, worker.region) == other.region;
        if (!(copied || heir_of_newcomer) || other.gone || Silent(now, instance, heir) || !Outlives(instance, heir, i))
          continue;
        deaths.push_back({worker.region, worker.incarnation, false});
        break;
      }
    }
  }
  return deaths;
}

// Newcomers whose heirs have told of a copy.
std::optional<records::Instance> Cluster::NextProtected(const InstanceEntry& instance) const {
  std::optional<records::Instance> next;
  for (int i = 0; i < instance.record.placements_size(); ++i) {
    const records::Placement& placement = instance.record.placements(i);
    if (!placement.unprotected()) continue;
    const bool copied = std::any_of(instance.workers.begin(), instance.workers.end(), [&](const WorkerEntry& worker) {
      return std::any_of(
          worker.report.standbys().begin(), worker.report.standbys().end(),
          [&](const v1::StandbyStatus& standby) { return standby.incarnation() == placement.incarnation(); });
    });
    if (!copied) continue;
    if (!next) next = instance.record;
    next->mutable_placements(i)->set_unprotected(false);
  }
  return next;
}

// --- What follows ---

std::optional<records::Instance> Cluster::NextFailover(Moment now, InstanceEntry& instance) {
  const records::Instance& record = instance.record;
  if (!instance.restore_wanted.empty()) return std::nullopt;
  const std::vector<Death> deaths = Deaths(now, instance);
  if (!deaths.empty()) return BuryAndBegin(now, instance, deaths);
  if (!record.has_failover()) return std::nullopt;
  if (!record.failover().has_resolution()) {
    if (const std::string waits_for = WaitsFor(record, instance.failover, now); !waits_for.empty()) {
      if (now.steady - instance.failover.since < settings_.failover_timeout) return std::nullopt;
      return GiveUp(
          now, instance,
          absl::StrCat("failover of ", DescribeFailover(record.failover()), " timed out waiting for ", waits_for));
    }
    auto resolved = ResolveFailover(record, instance.failover);
    if (!resolved.ok()) return GiveUp(now, instance, std::string(resolved.status().message()));
    return *std::move(resolved);
  }
  if (!AllRunByMap(instance)) return std::nullopt;
  records::Instance next = EndFailover(record);
  const auto took = now.unix_time - FromTimestamp(record.failover().begin_time());
  AddEvent(next, now,
           absl::StrCat("failover of ", DescribeFailover(record.failover()), ": ",
                        record.failover().resolution().takeovers_size(), " bodies taken up, ",
                        record.failover().resolution().lost_size(), " lost, ",
                        std::chrono::duration_cast<std::chrono::milliseconds>(took).count(), " ms"));
  effects_.failovers.push_back(took);
  return next;
}

std::optional<records::Instance> Cluster::BuryAndBegin(Moment now, InstanceEntry& instance,
                                                       const std::vector<Death>& deaths) {
  const records::Instance& record = instance.record;
  std::vector<std::string> endings;
  for (const WorkerEntry& worker : instance.workers) {
    const bool died = std::any_of(deaths.begin(), deaths.end(),
                                  [&](const Death& death) { return death.incarnation == worker.incarnation; });
    if (!died) continue;
    const HostEntry* host = HostAt(instance, static_cast<std::size_t>(&worker - instance.workers.data()));
    endings.push_back(absl::StrCat("region ", worker.region, " on ", host ? host->record.name() : "a removed host",
                                   ": ", worker.gone ? worker.ending : "silent"));
  }
  const std::string why = absl::StrJoin(endings, "; ");
  const std::vector<std::uint32_t> beyond = BeyondFailover(record, deaths);
  if (!beyond.empty()) {
    const bool has_heirs = record.map().regions_size() > 1;
    return GiveUp(now, instance,
                  has_heirs
                      ? absl::StrCat(why, " (lost together with its heir: region ", absl::StrJoin(beyond, ", "), ")")
                      : why);
  }
  std::map<std::uint32_t, std::string> hosts;
  for (const records::Placement& placement : record.placements()) hosts[placement.region()] = placement.host_id();
  auto begun = BeginFailover(
      record, deaths, [&](RegionId region) { return hosts[region.value()]; }, CutsOf(instance), now);
  if (!begun.ok()) return GiveUp(now, instance, std::string(begun.status().message()));
  AddEvent(*begun, now, why);
  if (!begun->has_failover()) instance.change_after = now.steady + kChangeRetry;
  return *std::move(begun);
}

// From a checkpoint, if there is one. Else the world is lost.
std::optional<records::Instance> Cluster::GiveUp(Moment now, InstanceEntry& instance, std::string why) {
  if (!instance.record.checkpoints().empty()) {
    instance.restore_wanted = std::move(why);
    instance.change_after = now.steady + kChangeRetry;
    effects_.restore.insert(instance.record.id());
    return std::nullopt;
  }
  records::Instance next = instance.record;
  next.set_state(v1::INSTANCE_STATE_FAILED);
  next.set_reason(OneLine(why, kMaxReasonBytes));
  next.clear_failover();
  next.clear_planned();
  *next.mutable_end_time() = ToTimestamp(now.unix_time);
  return next;
}

bool Cluster::AllRunByMap(const InstanceEntry& instance) const {
  return std::all_of(instance.workers.begin(), instance.workers.end(), [&](const WorkerEntry& worker) {
    return worker.report.phase() == v1::WORKER_PHASE_RUNNING &&
           worker.report.map_version() >= instance.record.map().version();
  });
}

// What is known from the beginning: when we ourselves last renewed the leases of the dead. After a restart that is not
// known, and may have been just now.
void Cluster::WatchFailover(Moment now, InstanceEntry& instance, const records::Instance& next) {
  if (!next.has_failover()) return;
  FailoverWatch watch;
  watch.version = next.map().version();
  watch.since = now.steady;
  watch.exited = instance.failover.exited;
  for (const records::Dead& dead : next.failover().dead()) {
    if (dead.exit_seen()) watch.exited.insert(dead.incarnation());
    const auto before = instance.failover.stands_still_at.find(dead.incarnation());
    if (before != instance.failover.stands_still_at.end()) watch.stands_still_at.insert(*before);
    const auto worker = std::find_if(instance.workers.begin(), instance.workers.end(),
                                     [&](const WorkerEntry& entry) { return entry.incarnation == dead.incarnation(); });
    if (worker == instance.workers.end()) continue;  // no failover of this life, or buried before
    watch.stands_still_at[dead.incarnation()] =
        worker->leased_at.count() == 0 ? Steady(0) : worker->leased_at + kLeaseTtl + kLeaseDrift;
  }
  instance.failover = std::move(watch);
}

}  // namespace tessera::control
