#include "control_plane/cluster/failovers.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/branches.h"
#include "control_plane/cluster/liveness.h"
#include "control_plane/cluster/recovery.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/standbys.h"
#include "control_plane/world_terms.h"

namespace tessera::control {
namespace {

constexpr std::chrono::milliseconds kOrdersPatience{500};  // for agents' streams to take their orders
// A standstill that regions report within so long after a failover is its own, and an event if it is so much longer
// than what was said.
constexpr std::chrono::milliseconds kStoodPatience{5000}, kStoodTolerance{500};
constexpr std::uint64_t kMostGapMs = 31'536'000'000;  // a year; who reports more lies

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

std::string SecondOf(std::chrono::nanoseconds unix_time) {
  google::protobuf::Timestamp second = ToTimestamp(unix_time);
  second.set_nanos(0);
  return google::protobuf::util::TimeUtil::ToString(second);
}

// "waits for host beta, silent since 2026-11-28T02:03:04Z: regions 3, 4; if a machine is gone for good: ..."
std::string DescribeAwaited(const ClusterState& state, const InstanceEntry& instance,
                            const std::vector<std::size_t>& awaited) {
  std::map<std::string, std::set<std::uint32_t>> regions;
  std::string name, text;
  for (const std::size_t index : awaited) {
    const HostEntry* host = HostAt(state, instance, index);
    if (host == nullptr) continue;  // its workers are gone
    name = host->record.name();
    const bool heard = host->last_heartbeat_time.count() != 0;
    const std::string since = heard ? SecondOf(host->last_heartbeat_time) : "this control plane began";
    regions[absl::StrCat("waits for host ", name, ", silent since ", since)].insert(instance.workers[index].region);
  }
  for (const auto& [wait, of] : regions) {
    absl::StrAppend(&text, wait, ": region", of.size() == 1 ? " " : "s ", absl::StrJoin(of, ", "), "; ");
  }
  if (regions.size() > 1) name = "HOST";
  return text.empty() ? "" : text + "if a machine is gone for good: tessera host remove " + name + " --force";
}

bool AwaitsResolution(const records::Instance& record) {
  return record.has_failover() && !record.failover().has_resolution();
}

std::chrono::milliseconds ToMs(std::chrono::nanoseconds span) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(span);
}

// The longest time without a step that a region reports, and had not reported before; 0: none has.
std::chrono::milliseconds LongestGap(const InstanceEntry& instance,
                                     const std::map<std::uint64_t, std::uint64_t>& before) {
  std::uint64_t longest = 0;
  for (const WorkerEntry& worker : instance.workers) {
    const std::uint64_t gap = worker.report.last_gap_ms();
    const auto known = before.find(worker.incarnation);
    if (known != before.end() && gap != known->second) longest = std::max(longest, std::min(gap, kMostGapMs));
  }
  return std::chrono::milliseconds(longest);
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
  standstills_.erase(number);
  adopted_.erase(number);
  silent_at_.erase(number);
  awaits_said_.erase(number);
}

const Failovers::Told* Failovers::ToldIn(const InstanceEntry& instance) const {
  const auto told = told_.find(instance.number);
  if (told == told_.end() || !AwaitsResolution(instance.record)) return nullptr;
  return told->second.version == instance.record.map().version() ? &told->second : nullptr;
}

// Some of the living may have been sent a resolution that is not stored.
bool Failovers::BegunByAnother(const InstanceEntry& instance) const {
  const auto adopted = adopted_.find(instance.number);
  return adopted != adopted_.end() && AwaitsResolution(instance.record) &&
         adopted->second == instance.record.map().version();
}

FailoverStep Failovers::Next(const InstanceEntry& instance, const CutBetween& cut, Now now) {
  std::vector<std::size_t> awaited;
  if (const std::vector<Death> deaths = Deaths(instance, awaited, now); !deaths.empty()) {
    return Begin(instance, deaths, DescribeDeaths(state_, instance, deaths), cut, now);
  }
  const std::vector<std::size_t> unanswered = SilentUnanswered(instance, now);
  awaited.insert(awaited.end(), unanswered.begin(), unanswered.end());
  std::string awaits = DescribeAwaited(state_, instance, awaited);
  if (BegunByAnother(instance)) {
    return Begin(instance, {}, "another control plane began the failover, which begins anew", cut, now);
  }
  if (auto said = NextAwaited(instance, awaits, now)) return {.next = std::move(said), .awaits = std::move(awaits)};
  FailoverStep step = GoOn(instance, !unanswered.empty(), now);
  if (step.given_up.empty()) step.awaits = std::move(awaits);
  return step;
}

// Nobody is to be declared dead. `silent`: inventories of silent hosts are awaited.
FailoverStep Failovers::GoOn(const InstanceEntry& instance, bool silent, Now now) {
  const records::Instance& record = instance.record;
  if (!record.has_failover()) return NextStood(instance, now);
  if (AwaitsResolution(record)) return Resolve(instance, silent, now);
  if (!AllRunByMap(instance)) return {};
  return End(instance, now);
}

// --- 1. Declare dead.

// Those that have ended or whose host was evicted, and those that are silent while another carries them on; the rest
// may well run, and is left alone. A newcomer that is silent before its map is committed has nothing to lose. Appends
// to `awaited` the indices of those that would be dead for their silence but for a last copy that they may have, and of
// those whom nobody can carry on, once their host is lost.
std::vector<Death> Failovers::Deaths(const InstanceEntry& instance, std::vector<std::size_t>& awaited, Now now) const {
  std::vector<Death> deaths;
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    if (worker.gone) {
      deaths.push_back({worker.region, worker.incarnation, !worker.evicted});
    } else if (Silent(state_, instance, i, settings_.failover_after, now)) {
      const bool joins = instance.record.placements(static_cast<int>(i)).joins();
      const bool has_no_part = joins && !instance.record.planned().committed();
      if (!has_no_part && !CarriedOnByAnother(instance, i, now)) {
        const HostEntry* host = HostAt(state_, instance, i);
        if (host != nullptr && host->lost) awaited.push_back(i);
      } else if (!has_no_part && IsAwaited(instance, i, now)) {
        awaited.push_back(i);
      } else {
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

// True if the standby reported when the other had been silent for long. Where both fall silent at one time it is not
// known whom to believe, and the one whose last word is a little older may be the one that lives. A word of its agent
// alone proves nothing: that of a machine that crashed is heard before it has said which workers it found dead.
bool Failovers::Outlives(const InstanceEntry& instance, std::size_t standby, std::size_t other) const {
  const HostEntry *own = HostAt(state_, instance, standby), *others = HostAt(state_, instance, other);
  if (own == nullptr || others == nullptr) return own != nullptr;
  return instance.workers[standby].reported_at - LastSignOf(state_, instance, other) >= settings_.failover_after / 2;
}

// True if the worker itself, or its standby, has just said that it lives. Its agent's word alone is none, as above.
bool Failovers::IsHeard(const WorkerEntry& worker, Now now) const {
  const Steady last = std::max(worker.reported_at, worker.witnessed_at);
  return !worker.gone && now.steady - last <= settings_.failover_after;
}

// True if the worker is the standby, or has the only copy that is known, of a region that died and is not carried on
// yet, or of which nothing is heard either; or if its own standby has ended, so that only itself is left of its region.
bool Failovers::MayHaveLastCopy(const InstanceEntry& instance, std::size_t index, Now now) const {
  const records::Instance& record = instance.record;
  const WorkerEntry& worker = instance.workers[index];
  const auto copies = [&](std::uint32_t standby, std::uint64_t incarnation) {
    if (standby == worker.region) return true;  // whatever it last reported: its copy has grown since
    return HoldsCopyOf(worker, incarnation) &&
           std::none_of(instance.workers.begin(), instance.workers.end(), [&](const WorkerEntry& other) {
             return IsHeard(other, now) && HoldsCopyOf(other, incarnation);
           });
  };
  const bool resumed = worker.report.map_version() >= record.map().version();
  for (const records::Dead& dead : record.failover().dead()) {
    if (!resumed && !dead.newcomer() && copies(dead.standby(), dead.incarnation())) return true;
  }
  const std::uint32_t own_standby = StandbyOf(record, worker.region);
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& other = instance.workers[i];
    const records::Placement& placement = record.placements(static_cast<int>(i));
    if (i == index || placement.joins() || placement.unprotected()) continue;
    if (other.gone && other.region == own_standby) return true;
    if (!IsHeard(other, now) && copies(StandbyOf(record, other.region), other.incarnation)) return true;
  }
  return false;
}

// True while a silent worker is waited for instead of being declared dead.
bool Failovers::IsAwaited(const InstanceEntry& instance, std::size_t index, Now now) const {
  if (!MayHaveLastCopy(instance, index, now)) return false;
  Steady since = LastSignOf(state_, instance, index);
  const auto watch = watches_.find(instance.number);
  if (instance.record.has_failover() && watch != watches_.end()) since = std::max(since, watch->second.since());
  return now.steady - since < PatienceFor(instance);
}

// For silent hosts. A world with a checkpoint loses some time if it begins again from there, one without is lost.
Steady Failovers::PatienceFor(const InstanceEntry& instance) const {
  const bool can_go_back = NewestKept(instance.record.checkpoints()) != nullptr;
  return can_go_back ? settings_.failover_timeout : settings_.silence_patience;
}

// Indices of the workers whose inventories the failover lacks, and whose agents are not heard.
std::vector<std::size_t> Failovers::SilentUnanswered(const InstanceEntry& instance, Now now) const {
  std::vector<std::size_t> silent;
  const auto watch = watches_.find(instance.number);
  if (!AwaitsResolution(instance.record) || watch == watches_.end() || ToldIn(instance) != nullptr) return silent;
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const HostEntry* host = HostAt(state_, instance, i);
    const bool heard = host != nullptr && now.steady - host->last_heard <= settings_.failover_after;
    const bool answered = watch->second.inventories().contains(instance.workers[i].region);
    if (!heard && !answered && !instance.workers[i].gone) silent.push_back(i);
  }
  return silent;
}

// An event says who is waited for, once for each map, however often a host is heard in between.
std::optional<records::Instance> Failovers::NextAwaited(const InstanceEntry& instance, const std::string& awaits,
                                                        Now now) {
  if (awaits.empty()) return std::nullopt;
  const std::uint64_t version = instance.record.map().version();
  if (std::exchange(awaits_said_[instance.number], version) == version) return std::nullopt;
  records::Instance next = instance.record;
  AddEvent(next, now, awaits);
  return next;
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
    record = WithResolution(instance.record, told->resolution, now);
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
  if (begun->has_failover() && !record.has_failover()) {
    begun_at_[instance.number] = now.steady;
    NoteStandstill(instance, deaths);
  }
  if (begun->has_failover() && new_map) watches_[instance.number].Begin(*begun, LeasesOf(instance), now);
  const bool dropped_plan = !begun->has_failover();
  return {.next = *std::move(begun), .players = std::move(players), .dropped_plan = dropped_plan};
}

// --- 2. Inventory, 3. Resolve.

FailoverStep Failovers::Resolve(const InstanceEntry& instance, bool silent, Now now) {
  const records::Instance& record = instance.record;
  if (const Told* told = ToldIn(instance)) {  // a slow store holds up whatever comes after it
    records::Instance next = WithResolution(record, told->resolution, now);
    Players players = WithNewSpawns(instance.players, record, told->resolution);
    if (!OrdersAreOut(instance) && now.steady - told->at < kOrdersPatience) {
      return {.told = std::move(next), .players = std::move(players)};
    }
    return {.next = std::move(next), .players = std::move(players)};
  }
  const FailoverWatch& watch = watches_[instance.number];
  if (const std::string waits_for = watch.WaitsFor(record, now); !waits_for.empty()) {
    Steady& silent_at = silent_at_[instance.number];
    if (silent) silent_at = now.steady;
    // A host that is heard again has its time to answer from then on.
    const Steady since = silent ? watch.since() : std::max(watch.since(), silent_at);
    if (now.steady - since < (silent ? PatienceFor(instance) : settings_.failover_timeout)) return {};
    return {.given_up = absl::StrCat("failover of ", DescribeFailover(record.failover()), " timed out waiting for ",
                                     waits_for)};
  }
  auto resolved = ResolveFailover(record, watch.inventories());
  if (!resolved.ok()) return {.given_up = std::string(resolved.status().message())};
  told_[instance.number] = {record.map().version(), now.steady, *resolved};
  return {.told = WithResolution(record, *resolved, now),
          .players = WithNewSpawns(instance.players, record, *resolved)};
}

// True once no host that can be reached waits for orders about the instance.
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
  std::string text =
      absl::StrCat("failover of ", DescribeFailover(failover), ": ", failover.resolution().takeovers_size(),
                   " bodies promoted, ", failover.resolution().lost_size(), " lost, ", ToMs(took).count(), " ms");
  if (const auto found = standstills_.find(instance.number); found != standstills_.end()) {
    Standstill& stood = found->second;
    stood.said_at = now.steady;
    std::chrono::milliseconds known = LongestGap(instance, stood.gaps);
    if (stood.since.count() != 0) known = std::max(known, ToMs(now.steady - stood.since));
    stood.said = std::max(ToMs(took), known);
    if (known.count() > 0) absl::StrAppend(&text, "; the world stood up to ", stood.said.count(), " ms");
  }
  AddEvent(next, now, text);
  state_.effects().failovers.push_back(took);
  return {.next = std::move(next)};
}

// A world that is paused stands anyway. An exit without a report in this life is of a worker that died before it.
void Failovers::NoteStandstill(const InstanceEntry& instance, const std::vector<Death>& deaths) {
  standstills_.erase(instance.number);
  if (IsPaused(instance.record)) return;
  Standstill stood;
  for (const WorkerEntry& worker : instance.workers) {
    stood.gaps[worker.incarnation] = worker.report.last_gap_ms();
    const bool died = std::any_of(deaths.begin(), deaths.end(),
                                  [&](const Death& death) { return death.incarnation == worker.incarnation; });
    const Steady sign = std::max(worker.reported_at, worker.witnessed_at);
    if (died && sign.count() != 0) stood.since = stood.since.count() == 0 ? sign : std::min(stood.since, sign);
  }
  standstills_[instance.number] = std::move(stood);
}

// The regions know how long they stood once they step again, which is after they report the map: they may have stood
// for a control plane that was away.
FailoverStep Failovers::NextStood(const InstanceEntry& instance, Now now) {
  const auto found = standstills_.find(instance.number);
  if (found == standstills_.end()) return {};
  const std::chrono::milliseconds gap = LongestGap(instance, found->second.gaps);
  if (gap <= found->second.said + kStoodTolerance) {
    if (now.steady - found->second.said_at >= kStoodPatience) standstills_.erase(found);
    return {};
  }
  standstills_.erase(found);
  records::Instance next = instance.record;
  AddEvent(next, now, absl::StrCat("the world stood ", gap.count(), " ms for the failover before, as its regions say"));
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
  // Until it is known what runs, the worker may be one that was cut off and carried on elsewhere since the backup.
  if (state_.recovering() && !state_.recovers_unreadable()) return;
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
