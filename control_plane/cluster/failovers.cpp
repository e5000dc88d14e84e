#include "control_plane/cluster/failovers.h"

#include <algorithm>
#include <chrono>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/cluster/liveness.h"
#include "control_plane/cluster/recovery.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/standbys.h"

namespace tessera::control {
namespace {

constexpr std::chrono::milliseconds kOrdersPatience{500};  // for agents' streams to take their orders

// "region 3 on alpha: silent; region 4 on beta: worker was killed by signal 9"
std::string DescribeDeaths(const ClusterState& state, const InstanceEntry& instance, const std::vector<Death>& deaths) {
  std::vector<std::string> endings;
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    const bool died = std::any_of(deaths.begin(), deaths.end(),
                                  [&](const Death& death) { return death.incarnation == worker.incarnation; });
    if (!died) continue;
    const HostEntry* host = HostAt(state, instance, i);
    endings.push_back(absl::StrCat("region ", worker.region, " on ", host ? host->record.name() : "a removed host",
                                   ": ", worker.gone ? worker.ending : "silent"));
  }
  return absl::StrJoin(endings, "; ");
}

bool AwaitsResolution(const records::Instance& record) {
  return record.has_failover() && !record.failover().has_resolution();
}

std::map<std::uint64_t, Steady> LeasesOf(const InstanceEntry& instance) {
  std::map<std::uint64_t, Steady> leased_at;
  for (const WorkerEntry& worker : instance.workers) leased_at[worker.incarnation] = worker.leased_at;
  return leased_at;
}

}  // namespace

void Failovers::Adopt(const InstanceEntry& instance, Now now) {
  if (!instance.record.has_failover()) return;
  watches_[instance.number].Begin(instance.record, LeasesOf(instance), now);
  adopted_[instance.number] = instance.record.map().version();
}

void Failovers::Forget(std::uint64_t number) {
  watches_.erase(number);
  begun_at_.erase(number);
  told_.erase(number);
  adopted_.erase(number);
}

const Failovers::Told* Failovers::ToldIn(const InstanceEntry& instance) const {
  const auto told = told_.find(instance.number);
  if (told == told_.end() || !AwaitsResolution(instance.record)) return nullptr;
  return told->second.version == instance.record.map().version() ? &told->second : nullptr;
}

// Some of the living may have been told a resolution that is not stored.
bool Failovers::BegunByAnother(const InstanceEntry& instance) const {
  const auto adopted = adopted_.find(instance.number);
  return adopted != adopted_.end() && AwaitsResolution(instance.record) &&
         adopted->second == instance.record.map().version();
}

FailoverStep Failovers::Next(const InstanceEntry& instance, const CutBetween& cut, Now now) {
  const records::Instance& record = instance.record;
  if (const std::vector<Death> deaths = Deaths(instance, now); !deaths.empty()) {
    return Begin(instance, deaths, DescribeDeaths(state_, instance, deaths), cut, now);
  }
  if (!record.has_failover()) return {};
  if (BegunByAnother(instance)) {
    return Begin(instance, {}, "another control plane began the failover, which begins anew", cut, now);
  }
  if (AwaitsResolution(record)) return Resolve(instance, now);
  if (!AllRunByMap(instance)) return {};
  return End(instance, now);
}

// --- 1. Declare dead.

// Those that have ended or whose host was evicted, and those that are silent while another carries them on; the rest
// may well run, and is left alone. A newcomer that is silent before its map is committed has nothing to lose.
std::vector<Death> Failovers::Deaths(const InstanceEntry& instance, Now now) const {
  std::vector<Death> deaths;
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    if (worker.gone) {
      deaths.push_back({worker.region, worker.incarnation, !worker.evicted});
    } else if (Silent(state_, instance, i, settings_.failover_after, now)) {
      const bool joins = instance.record.placements(static_cast<int>(i)).joins();
      const bool has_no_part = joins && !instance.record.planned().committed();
      if (has_no_part || CarriedOnByAnother(instance, i, now)) {
        deaths.push_back({worker.region, worker.incarnation, false});
      }
    }
  }
  return deaths;
}

// True if another worker, whose host is heard, has a whole copy to go on with. A newcomer whose map is committed needs
// no copy: it has acknowledged nothing that its standby lacks; all the others wait for either.
bool Failovers::CarriedOnByAnother(const InstanceEntry& instance, std::size_t dead, Now now) const {
  const WorkerEntry& worker = instance.workers[dead];
  const bool newcomer = instance.record.placements(static_cast<int>(dead)).unprotected();
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& other = instance.workers[i];
    const bool carries = HoldsCopyOf(other, worker.incarnation) ||
                         (newcomer && StandbyOf(instance.record, worker.region) == other.region);
    if (carries && !other.gone && !Silent(state_, instance, i, settings_.failover_after, now) &&
        Outlives(instance, i, dead)) {
      return true;
    }
  }
  return false;
}

// True if the standby was heard when the other had been silent for long. Where both fall silent at one time it is not
// known whom to believe, and the one whose last word is a little older may be the one that lives.
bool Failovers::Outlives(const InstanceEntry& instance, std::size_t standby, std::size_t other) const {
  const HostEntry *own = HostAt(state_, instance, standby), *others = HostAt(state_, instance, other);
  if (own == nullptr || others == nullptr) return own != nullptr;
  const Steady last_sign = std::max(others->last_heard, instance.workers[other].witnessed_at);
  return own->last_heard - last_sign >= settings_.failover_after / 2;
}

// Its worker counts as dead, but its end has not been seen: the failover waits for that, or for its lease to run out.
FailoverStep Failovers::CarryOn(const InstanceEntry& instance, std::uint32_t region, const CutBetween& cut, Now now) {
  const auto worker = std::find_if(instance.workers.begin(), instance.workers.end(),
                                   [region](const WorkerEntry& entry) { return entry.region == region; });
  if (worker == instance.workers.end() || worker->gone || instance.record.has_failover()) return {};
  const std::vector<Death> ends = {{region, worker->incarnation, false}};
  if (!BeyondFailover(instance.record, ends).empty()) return {};
  const std::string why = absl::StrCat("region ", region, " to be carried on by region ",
                                       StandbyOf(instance.record, region), ": its bodies wait for a cut link");
  FailoverStep step = Begin(instance, ends, why, cut, now);
  return step.next ? std::move(step) : FailoverStep();
}

FailoverStep Failovers::Begin(const InstanceEntry& instance, const std::vector<Death>& deaths, const std::string& why,
                              const CutBetween& cut, Now now) {
  const Told* const told = ToldIn(instance);
  records::Instance record = instance.record;
  std::optional<Players> players;
  if (told != nullptr) {
    record = WithResolution(instance.record, told->resolution);
    players = WithNewSpawns(instance.players, instance.record, told->resolution);
  }
  if (const std::vector<std::uint32_t> beyond = BeyondFailover(record, deaths); !beyond.empty()) {
    const bool has_standbys = record.map().regions_size() > 1;
    return {.given_up = has_standbys ? absl::StrCat(why, " (lost together with its standby: region ",
                                                    absl::StrJoin(beyond, ", "), ")")
                                     : why};
  }
  if (BegunByAnother(instance)) record = MaybeResolved(record);
  auto begun = BeginFailover(record, deaths, cut, now);
  if (!begun.ok()) return {.given_up = std::string(begun.status().message())};
  AddEvent(*begun, now, why);
  const bool new_map = begun->map().version() != record.map().version();
  if (begun->has_failover() && !record.has_failover()) begun_at_[instance.number] = now.steady;
  if (begun->has_failover() && new_map) watches_[instance.number].Begin(*begun, LeasesOf(instance), now);
  const bool dropped_plan = !begun->has_failover();
  return {.next = *std::move(begun), .players = std::move(players), .dropped_plan = dropped_plan};
}

// --- 2. Inventory, 3. Resolve.

FailoverStep Failovers::Resolve(const InstanceEntry& instance, Now now) {
  const records::Instance& record = instance.record;
  if (const Told* told = ToldIn(instance)) {  // a slow store holds up whatever comes after it
    records::Instance next = WithResolution(record, told->resolution);
    Players players = WithNewSpawns(instance.players, record, told->resolution);
    if (!OrdersAreOut(instance) && now.steady - told->at < kOrdersPatience) {
      return {.told = std::move(next), .players = std::move(players)};
    }
    return {.next = std::move(next), .players = std::move(players)};
  }
  const FailoverWatch& watch = watches_[instance.number];
  if (const std::string waits_for = watch.WaitsFor(record, now); !waits_for.empty()) {
    if (now.steady - watch.since() < settings_.failover_timeout) return {};
    return {.given_up = absl::StrCat("failover of ", DescribeFailover(record.failover()), " timed out waiting for ",
                                     waits_for)};
  }
  auto resolved = ResolveFailover(record, watch.inventories());
  if (!resolved.ok()) return {.given_up = std::string(resolved.status().message())};
  told_[instance.number] = {record.map().version(), now.steady, *resolved};
  return {.told = WithResolution(record, *resolved), .players = WithNewSpawns(instance.players, record, *resolved)};
}

// True if all hosts of the living that can be told have been.
bool Failovers::OrdersAreOut(const InstanceEntry& instance) const {
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const HostEntry* const host = HostAt(state_, instance, i);
    if (host != nullptr && host->stream != 0 && host->desired_changed) return false;
  }
  return true;
}

// --- 4. Resume.

// The wall clock may have been moved meanwhile; only a failover that an earlier life began is counted by it.
FailoverStep Failovers::End(const InstanceEntry& instance, Now now) {
  const records::Failover& failover = instance.record.failover();
  const auto begun = begun_at_.find(instance.number);
  std::chrono::nanoseconds took = now.unix_time - FromTimestamp(failover.begin_time());
  if (begun != begun_at_.end()) took = now.steady - begun->second;
  took = std::max(took, std::chrono::nanoseconds(0));
  records::Instance next = EndFailover(instance.record);
  AddEvent(next, now,
           absl::StrCat("failover of ", DescribeFailover(failover), ": ", failover.resolution().takeovers_size(),
                        " bodies promoted, ", failover.resolution().lost_size(), " lost, ",
                        std::chrono::duration_cast<std::chrono::milliseconds>(took).count(), " ms"));
  state_.effects().failovers.push_back(took);
  return {.next = std::move(next)};
}

std::optional<records::Instance> Failovers::NextProtected(const InstanceEntry& instance) {
  std::optional<records::Instance> next;
  for (int i = 0; i < instance.record.placements_size(); ++i) {
    const records::Placement& placement = instance.record.placements(i);
    if (!placement.unprotected()) continue;
    const bool copied = std::any_of(instance.workers.begin(), instance.workers.end(), [&](const WorkerEntry& worker) {
      return HoldsCopyOf(worker, placement.incarnation());
    });
    if (!copied) continue;
    if (!next) next = instance.record;
    next->mutable_placements(i)->set_unprotected(false);
  }
  return next;
}

// --- Evidence.

// The lease is counted from here on by the control plane, and from when it was asked for by the worker: it stops first.
void Failovers::RenewLease(const HostEntry& host, const v1::LeaseRequest& request, Now now) {
  const auto [instance, worker] = FindWorker(state_, host, request.identity());
  // Nobody knows yet, or ever, what else the worker should do than go on.
  const bool goes_on = state_.recovering() || IsUnknownWorker(host, request.identity());
  if (!goes_on && (instance == nullptr || worker->gone || !WantsWorkers(instance->record.state()))) return;
  if (worker != nullptr) worker->leased_at = now.steady;
  v1::LeaseRenewal renewal;
  *renewal.mutable_identity() = request.identity();
  renewal.set_number(request.number());
  renewal.set_ttl_ms(static_cast<std::uint32_t>(kLeaseTtl.count()));
  state_.effects().leases.emplace_back(host.stream, std::move(renewal));
}

void Failovers::Witness(InstanceEntry& instance, const v1::WorkerReport& before, const v1::WorkerReport& report,
                        Now now) {
  for (const v1::StandbyStatus& copy : report.standby_copies()) {
    const bool grown =
        std::none_of(before.standby_copies().begin(), before.standby_copies().end(), [&](const auto& old) {
          return old.incarnation() == copy.incarnation() && old.tick() >= copy.tick() && old.signs() >= copy.signs();
        });
    if (!grown) continue;
    for (WorkerEntry& worker : instance.workers) {
      if (worker.incarnation == copy.incarnation()) worker.witnessed_at = now.steady;
    }
  }
}

void Failovers::Forgive(Steady pause, Now now) {
  for (InstanceEntry& instance : state_.EachInstance()) {
    for (WorkerEntry& worker : instance.workers) {
      worker.witnessed_at = std::min(now.steady, worker.witnessed_at + pause);
    }
  }
}

// Only the host that ran it knows that it ended: a word of another would let a takeover begin while the worker's lease
// still holds.
InstanceEntry* Failovers::NoteExit(const HostEntry& host, const v1::WorkerExited& exited) {
  InstanceEntry* instance = state_.FindInstance(exited.identity().instance_id());
  if (instance == nullptr) return nullptr;
  const auto& dead = instance->record.failover().dead();
  const std::uint64_t incarnation = exited.identity().incarnation();
  const bool awaited = std::any_of(dead.begin(), dead.end(), [&](const records::Dead& entry) {
    return entry.incarnation() == incarnation && entry.host_id() == host.record.id();
  });
  if (!awaited) return nullptr;
  watches_[instance->number].AddExit(incarnation);
  return instance;
}

InstanceEntry* Failovers::NoteInventory(const HostEntry& host, const v1::InventoryReport& report, Now now) {
  const auto [instance, worker] = FindWorker(state_, host, report.identity());
  if (instance == nullptr || worker->gone || ToldIn(*instance) != nullptr) return nullptr;
  const auto added = watches_[instance->number].Add(instance->record, worker->region, report.inventory(), now);
  if (!added.ok()) {  // the worker's fault, not its agent's: others of that host live on
    state_.Log(absl::StrCat("inventory refused instance=", instance->record.id(), " region=", worker->region, ": ",
                            added.status().message()));
    return nullptr;
  }
  return *added ? instance : nullptr;
}

}  // namespace tessera::control
