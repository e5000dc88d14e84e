#include "control_plane/cluster/planned_changes.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/cluster/free_hosts.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/cluster/liveness.h"
#include "control_plane/cluster/loaded_bodies.h"
#include "control_plane/instance_record.h"
#include "control_plane/one_line.h"
#include "control_plane/standbys.h"
#include "control_plane/world_terms.h"
#include "core/game/native_name.h"
#include "core/world/limits.h"
#include "core/world/partition_io.h"
#include "core/world/world_terms.h"

namespace tessera::control {
namespace {

constexpr double kReportTicks = 64;  // a reported median is over so many; StepTimes in region_worker
constexpr std::chrono::nanoseconds kLongestWait = std::chrono::seconds(5);  // in a world that hardly moves

constexpr int kMaxSpread = 256;  // values an axis; a worker of ours reports fewer

bool Ascends(const google::protobuf::RepeatedField<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); }) &&
         std::is_sorted(values.begin(), values.end());
}

// Empty, as if it were not known, unless the report holds a spread.
RegionSpread SpreadOf(const v1::WorkerReport& report) {
  const auto &x = report.spread_x(), &z = report.spread_z();
  if (x.size() < 2 || x.size() > kMaxSpread || x.size() != z.size() || !Ascends(x) || !Ascends(z)) return {};
  return {{x.begin(), x.end()}, {z.begin(), z.end()}};
}

// Where borders are to be balanced, a change waits until the reported step times all come from the map that came into
// force just now.
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

bool OwnsCells(const v1::PartitionMap& map, std::uint32_t region) {
  return std::any_of(map.cells().begin(), map.cells().end(),
                     [region](const v1::Cell& cell) { return cell.owner() == region; });
}

// The index of the region's worker; `workers.size()` if there is none.
std::size_t IndexOf(const InstanceEntry& instance, std::uint32_t region) {
  const auto at = std::find_if(instance.workers.begin(), instance.workers.end(),
                               [region](const WorkerEntry& worker) { return worker.region == region; });
  return static_cast<std::size_t>(at - instance.workers.begin());
}

// True if `region` has a link to `other`, or is not there to have one.
bool Hears(const InstanceEntry& instance, std::uint32_t region, std::uint32_t other) {
  const std::size_t index = IndexOf(instance, region);
  if (index == instance.workers.size()) return true;
  const auto& linked = instance.workers[index].report.linked_regions();
  return std::find(linked.begin(), linked.end(), other) != linked.end();
}

}  // namespace

std::optional<std::uint64_t> StandingTick(const InstanceEntry& instance) {
  const auto stands = [&](const WorkerEntry& worker) {
    return worker.report.tick() == instance.workers.front().report.tick();
  };
  const bool all = !instance.workers.empty() && AllRunByMap(instance) && std::ranges::all_of(instance.workers, stands);
  return all ? std::optional(instance.workers.front().report.tick()) : std::nullopt;
}

// --- What is asked for.

absl::StatusOr<std::optional<records::Instance>> PlannedChanges::Scale(const InstanceEntry& instance,
                                                                       std::uint32_t regions, Now now) const {
  records::Instance next = instance.record;
  next.set_wanted_regions(regions);
  if (AtRest(next)) {  // else it is tried once that is over
    const auto planned =
        PlanChange(next, Facts(instance, now),
                   HeardHosts(state_, NeedsOf(instance.record), nullptr, settings_.failover_after, now));
    if (!planned.ok()) return NamingLackingHosts(state_, NeedsOf(instance.record), planned.status());
  }
  if (next.wanted_regions() == instance.record.wanted_regions()) return std::nullopt;
  AddEvent(next, now, absl::StrCat("scaling from ", instance.record.map().regions_size(), " to ", regions));
  return next;
}

absl::StatusOr<std::optional<records::Instance>> PlannedChanges::Restart(const InstanceEntry& instance, Now now) const {
  const bool under_way = std::any_of(instance.workers.begin(), instance.workers.end(), [&](const WorkerEntry& worker) {
    return worker.incarnation <= instance.record.replace_up_to();
  });
  if (under_way) return std::nullopt;
  records::Instance next = instance.record;
  next.set_replace_up_to(next.last_incarnation());
  if (AtRest(next)) {  // else it is tried once that is over
    const auto planned =
        PlanChange(next, Facts(instance, now),
                   HeardHosts(state_, NeedsOf(instance.record), nullptr, settings_.failover_after, now));
    if (!planned.ok()) return NamingLackingHosts(state_, NeedsOf(instance.record), planned.status());
  }
  if (next.wanted_regions() == 0) next.set_wanted_regions(static_cast<std::uint32_t>(next.map().regions_size()));
  AddEvent(next, now, absl::StrCat("replacing ", next.map().regions_size(), " workers one after the other"));
  return next;
}

std::optional<records::Instance> PlannedChanges::Pause(const InstanceEntry& instance, bool paused, Now now) {
  if (instance.record.clock().paused() == paused) return std::nullopt;
  records::Instance next = instance.record;
  next.mutable_clock()->set_paused(paused);
  if (!paused) ForgetStep(next);
  AddEvent(next, now, paused ? "to be paused" : "to go on");
  return next;
}

absl::StatusOr<std::optional<records::Instance>> PlannedChanges::MakeTicks(const InstanceEntry& instance,
                                                                           std::uint32_t ticks, Now now) {
  const records::Instance& record = instance.record;
  if (ticks < 1 || ticks > kMaxStepTicks) {
    return absl::InvalidArgumentError(absl::StrCat("ticks: ", ticks, " is not in 1 to ", kMaxStepTicks));
  }
  const auto refused = [&](absl::string_view why) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", record.id(), why));
  };
  if (record.has_failover()) return refused(" goes through a failover; try again");
  if (record.clock().paused() && record.has_planned()) return refused(" is about to stand; try again");
  if (!record.clock().paused() || !IsPaused(record)) return refused(" is not paused, so it makes no single ticks");
  const std::optional<std::uint64_t> tick = StandingTick(instance);
  if (!tick) return refused(": its regions do not all stand yet; try again");
  records::Instance next = PlanTicks(record, *tick, ticks);
  AddEvent(next, now, absl::StrCat("to make ", ticks, ticks == 1 ? " tick" : " ticks", " and stand again"));
  return next;
}

absl::StatusOr<std::optional<records::Instance>> PlannedChanges::SetPace(const InstanceEntry& instance,
                                                                         double ticks_per_second, Now now) {
  const std::uint32_t rate = instance.record.tick_rate_hz();
  if (!(ticks_per_second >= kMinTicksPerSecond && ticks_per_second <= rate)) {
    return absl::InvalidArgumentError(
        absl::StrCat("ticks_per_second: ", ticks_per_second, " is not in ", kMinTicksPerSecond, " to ", rate));
  }
  const double wanted = ticks_per_second == rate ? 0 : ticks_per_second;
  if (instance.record.clock().ticks_per_second() == wanted) return std::nullopt;
  records::Instance next = instance.record;
  next.mutable_clock()->set_ticks_per_second(wanted);
  AddEvent(next, now, absl::StrCat("to make ", ticks_per_second, " ticks a second"));
  return next;
}

absl::StatusOr<std::optional<records::Instance>> PlannedChanges::SetGame(const InstanceEntry& instance,
                                                                         const std::string& name,
                                                                         const std::string& hash, Now now) {
  const records::Instance& record = instance.record;
  if (record.game_hash().empty()) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", record.id(), " runs no game that could be replaced"));
  }
  if (record.game_native()) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", record.id(), " runs ",
                                                      game::NativeGameText(record.game_name(), record.game_hash()),
                                                      ", and a native game is not changed while its world runs"));
  }
  if (record.games().has_next() && record.games().next().hash() != hash) {
    return absl::FailedPreconditionError(
        absl::StrCat("id: ", record.id(), " is about to run game ", record.games().next().name(), "; try again"));
  }
  if (record.games().has_next() || record.game_hash() == hash) return std::nullopt;
  records::Instance next = record;
  records::Game& game = *next.mutable_games()->mutable_next();
  game.set_name(name);
  game.set_hash(hash);
  game.set_number(record.map().terms().game() + 1);
  next.mutable_games()->clear_refused();
  AddEvent(next, now,
           absl::StrCat("game ", name, " (", hash.substr(0, 12), ") to take the place of the one that runs"));
  return next;
}

// --- What follows from it, and from drains, deaths and loads.

std::optional<records::Instance> PlannedChanges::Next(InstanceEntry& instance, Now now) {
  NoteCuts(instance, now);
  const std::optional<SlowRegion> slow = slow_hosts_.Look(instance, now);
  if (auto next = NextTerms(instance, now)) return next;
  // Until it goes on nothing but a step can come into force.
  if (IsPaused(instance.record) && !instance.record.has_planned()) return std::nullopt;
  std::vector<RegionFacts> facts = Facts(instance, now);
  if (auto back = NextTakenBack(instance, facts, now)) return back;
  auto next = StepPlan(instance.record, facts);
  const bool steps = next.has_value();
  if (!steps) next = Plan(instance, std::move(facts), slow, now);
  Change& change = changes_[instance.number];
  if (next && next->has_planned() && AtRest(instance.record)) change.before = LayoutOf(state_, instance.record);
  if (!steps) return next;
  const bool in_force = instance.record.has_planned() && !next->has_planned();
  if (in_force) instance.taken_back.clear();
  const std::string terms =
      in_force ? DescribeTerms(instance.record, *next, instance.record.planned().effective_tick()) : "";
  if (!terms.empty() || AtRest(*next)) {
    change.not_before = now.steady + UntilNextChange(instance);
    AddEvent(*next, now, terms.empty() ? DescribeDone(change.before, LayoutOf(state_, *next)) : terms);
    if (AtRest(*next)) change.before.reset();
  }
  return next;
}

// Steps towards the terms that are wanted, once nothing else is under way. One worker that cannot run the next game is
// enough to keep the one that runs.
std::optional<records::Instance> PlannedChanges::NextTerms(const InstanceEntry& instance, Now now) {
  const records::Instance& record = instance.record;
  if (record.has_planned()) return std::nullopt;
  const std::string& hash = record.games().next().hash();
  bool loaded = !hash.empty();
  for (const WorkerEntry& worker : instance.workers) {
    const v1::NextGameStatus& status = worker.report.next_game();
    loaded = loaded && status.hash() == hash && status.failure().empty();
    if (hash.empty() || status.hash() != hash || status.failure().empty()) continue;
    records::Instance next = record;
    records::Games& games = *next.mutable_games();
    games.set_refused(OneLine(absl::StrCat("region ", worker.region, ": ", status.failure()), kMaxReasonBytes));
    AddEvent(next, now, absl::StrCat("game ", games.next().name(), " refused by ", games.refused()));
    games.clear_next();
    return next;
  }
  if (!AllRunByMap(instance)) return std::nullopt;
  auto next = StepTerms(record, loaded);
  if (next && !next->has_planned()) AddEvent(*next, now, DescribeTerms(record, *next, 0));
  return next;
}

std::optional<records::Instance> PlannedChanges::Plan(InstanceEntry& instance, std::vector<RegionFacts> facts,
                                                      const std::optional<SlowRegion>& slow, Now now) {
  Change& change = changes_[instance.number];
  const bool all_run = AllRunByMap(instance);
  if (!AtRest(instance.record) || !all_run || now.steady < change.not_before) return std::nullopt;
  std::vector<FreeHost> hosts = HeardHosts(state_, NeedsOf(instance.record), nullptr, settings_.failover_after, now);
  for (FreeHost& host : hosts) host.avoided = host.avoided || slow_hosts_.Avoids(instance.number, host.id, now);
  CutDecision cut = cut_links_.Look(instance, hosts, now);
  if (cut_links_.IsNews(instance.number, cut.stuck)) {
    records::Instance told = instance.record;
    AddEvent(told, now, cut.stuck);
    state_.Log(absl::StrCat("cut link id=", instance.record.id(), " ", cut.stuck), Severity::kError);
    return told;
  }
  const Leaver leaver = LeaverOf(instance, std::move(cut.move), slow, hosts, now);
  for (std::size_t i = 0; i < facts.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    facts[i].step_s = SmoothedStep(worker, change.workers[worker.incarnation]);
    facts[i].leaves_host = leaver.region() == worker.region;
  }
  auto planned = PlanChange(instance.record, facts, hosts);
  if (!planned.ok()) {
    change.not_before = now.steady + kChangeRetry;
    return NoteNoRoom(instance, facts, NamingLackingHosts(state_, NeedsOf(instance.record), planned.status()), now);
  }
  if (!std::exchange(instance.lacks_room, "").empty()) state_.MarkChanged(instance);
  if (!*planned) {
    change.not_before = now.steady + kBalanceInterval;
    instance.taken_back.clear();  // all is as wanted
  }
  const bool newcomer = *planned && (*planned)->last_incarnation() > instance.record.last_incarnation();
  if (newcomer && leaver.region() != 0 && !OwnsCells((*planned)->planned().map(), leaver.region())) {
    NoteMoved(instance, leaver, **planned, now);
  }
  return *std::move(planned);
}

// A change that waits is shown for as long as it does; the event and the line in the log come once.
std::optional<records::Instance> PlannedChanges::NoteNoRoom(InstanceEntry& instance, std::span<const RegionFacts> facts,
                                                            const absl::Status& why, Now now) {
  if (!absl::IsResourceExhausted(why)) {
    LogTrouble(state_, instance, "change cannot be made for now", why);
    return std::nullopt;
  }
  const std::string text = DescribeNoRoom(state_, instance.record, facts, std::string(why.message()));
  if (!std::exchange(instance.lacks_room, text).empty()) return std::nullopt;
  instance.lacks_room_since = now.unix_time;
  state_.MarkChanged(instance);
  state_.Log(absl::StrCat("change waits for room id=", instance.record.id(), ": ", text), Severity::kError);
  const auto& events = instance.record.events();
  if (!events.empty() && events.rbegin()->text() == text) return std::nullopt;  // said in an earlier life
  records::Instance told = instance.record;
  AddEvent(told, now, text);
  return told;
}

// --- Regions that leave their hosts.

PlannedChanges::Leaver PlannedChanges::LeaverOf(const InstanceEntry& instance, std::optional<CutMove> cut,
                                                const std::optional<SlowRegion>& slow, std::vector<FreeHost>& hosts,
                                                Now now) const {
  Leaver leaver;
  if (!cut) leaver.slow = slow;
  leaver.cut = std::move(cut);
  for (FreeHost& host : hosts) {
    const bool shunned = leaver.cut && leaver.cut->shunned.contains(host.id);
    host.avoided = host.avoided || shunned || cut_links_.Avoids(instance.number, host.id, now) ||
                   (leaver.slow && leaver.slow->host_id == host.id);
  }
  return leaver;
}

void PlannedChanges::NoteMoved(InstanceEntry& instance, const Leaver& leaver, records::Instance& planned, Now now) {
  ++instance.moved_regions;
  if (leaver.cut) {
    cut_links_.NoteMoved(instance, leaver.cut->region, now);
    AddEvent(planned, now, absl::StrCat("moving region ", leaver.cut->region, ": ", leaver.cut->what));
    state_.Log(absl::StrCat("cut link id=", instance.record.id(), " moved=", leaver.cut->region, " ", leaver.cut->what),
               Severity::kWarning);
    return;
  }
  slow_hosts_.NoteMoved(instance.number, *leaver.slow, now);
  const HostEntry* host = state_.FindHost(leaver.slow->host_id);
  const std::string what = Describe(*leaver.slow, host == nullptr ? leaver.slow->host_id : host->record.name());
  AddEvent(planned, now, "moving what a slow host holds up: " + what);
  state_.Log(absl::StrCat("slow host id=", instance.record.id(), " ", what), Severity::kWarning);
}

void PlannedChanges::NoteCarriedOn(InstanceEntry& instance, std::uint32_t region, Now now) {
  const bool leaves = !OwnsCells(instance.record.map(), region);
  if (!leaves) {  // else its move was noted when it was planned
    ++instance.moved_regions;
    cut_links_.NoteMoved(instance, region, now);
  }
  state_.Log(absl::StrCat("cut link id=", instance.record.id(), " carried_on=", region), Severity::kWarning);
}

// How long a step takes by what is in the region now and what that cost of late: a machine that is busy with something
// else makes one second's step times up to twice as long as the next one's, and borders would follow.
double PlannedChanges::SmoothedStep(const WorkerEntry& worker, WorkerLoad& load) {
  const double bodies = LoadedBodies(worker.report), cost_s = worker.report.step().p50_seconds() / bodies;
  load.body_cost_s = load.body_cost_s > 0 ? (load.body_cost_s + cost_s) / 2 : cost_s;
  return load.body_cost_s * bodies;
}

std::vector<RegionFacts> PlannedChanges::Facts(const InstanceEntry& instance, Now now) const {
  const auto change = changes_.find(instance.number);
  std::vector<RegionFacts> facts;
  facts.reserve(instance.workers.size());
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    const records::Placement& placement = instance.record.placements(static_cast<int>(i));
    const HostEntry* host = HostAt(state_, instance, i);
    const v1::WorkerReport& report = worker.report;
    RegionFacts& region = facts.emplace_back();
    region.region = worker.region;
    region.incarnation = worker.incarnation;
    region.host_id = placement.host_id();
    region.host_draining = host != nullptr && host->record.draining();
    region.newcomer = placement.joins();
    region.bound = worker.bound();
    region.running = report.phase() == v1::WORKER_PHASE_RUNNING;
    region.tick = TickOf(instance, worker, now);
    region.map_version = report.map_version();
    region.planned_version = report.planned_version();
    region.refused_version = report.refused_version();
    region.bodies_outside = report.bodies_outside();
    if (change != changes_.end()) {
      for (const auto& [pair, until] : change->second.cuts) {
        if (pair.first == worker.region) region.cut_from.push_back(pair.second);
        if (pair.second == worker.region) region.cut_from.push_back(pair.first);
      }
    }
    std::sort(region.cut_from.begin(), region.cut_from.end());
    region.step_s = report.step().p50_seconds();
    region.spread = SpreadOf(report);
  }
  SetUnlinked(instance, facts);
  return facts;
}

// --- Links of newcomers.

// Both ends have to say that a link is up: what was reported of the number before is of another worker.
void PlannedChanges::SetUnlinked(const InstanceEntry& instance, std::vector<RegionFacts>& facts) const {
  const v1::PlannedMap& planned = instance.record.planned();
  if (planned.effective_tick() == 0 || planned.committed()) return;
  if (std::none_of(facts.begin(), facts.end(), [](const RegionFacts& region) { return region.newcomer; })) return;
  const auto map = FromProto(planned.map());
  if (!map.ok()) return;
  std::map<std::uint32_t, const RegionFacts*> by_region;
  for (const RegionFacts& region : facts) by_region[region.region] = &region;
  for (RegionFacts& region : facts) {
    if (!region.newcomer || !map->HasRegion(RegionId(region.region))) continue;
    for (const RegionId neighbor : map->Neighbors(RegionId(region.region))) {
      const auto other = by_region.find(neighbor.value());
      if (other == by_region.end() || !other->second->cut_from.empty()) continue;
      if (Hears(instance, region.region, neighbor.value()) && Hears(instance, neighbor.value(), region.region))
        continue;
      region.unlinked.push_back(neighbor.value());
    }
  }
}

std::optional<records::Instance> PlannedChanges::NextTakenBack(InstanceEntry& instance,
                                                               std::span<const RegionFacts> facts, Now now) {
  Change& change = changes_[instance.number];
  const records::Instance& record = instance.record;
  instance.links_awaited.clear();
  if (!record.has_planned() || record.planned().committed()) change.unlinked = Steady(0);
  for (const RegionFacts& region : facts) {
    if (region.unlinked.empty()) continue;
    const HostEntry* host = state_.FindHost(region.host_id);
    absl::StrAppend(&instance.links_awaited, instance.links_awaited.empty() ? "" : "; ", "region ", region.region,
                    " on ", host == nullptr ? region.host_id : host->record.name(), " has no link to region",
                    region.unlinked.size() == 1 ? " " : "s ", absl::StrJoin(region.unlinked, ", "));
  }
  if (instance.links_awaited.empty()) {
    change.unlinked_at = Steady(0);
    return std::nullopt;
  }
  // Time in which nobody looked proves nothing.
  if (change.unlinked_at.count() != 0) change.unlinked += std::min<Steady>(now.steady - change.unlinked_at, kOwnPause);
  change.unlinked_at = now.steady;
  if (change.unlinked < kNewcomerLinkPatience) return std::nullopt;
  instance.taken_back = OneLine(absl::StrCat("map ", record.planned().map().version(),
                                             " taken back, tried again in a minute: ", instance.links_awaited,
                                             ". Do its program and theirs belong to one release?"),
                                kMaxReasonBytes);
  instance.links_awaited.clear();
  change.unlinked = change.unlinked_at = Steady(0);
  change.not_before = now.steady + kUnlinkedRetry;
  records::Instance next = TakenBack(record);
  AddEvent(next, now, instance.taken_back);
  state_.Log(absl::StrCat("change taken back id=", record.id(), ": ", instance.taken_back), Severity::kError);
  return next;
}

// --- Links that fail.

// Notes which regions cannot hear each other: neighbours that the world is degraded for, and who does not hear its
// standby. Once two are kept apart, and only then, a missing link between neighbours prolongs it. Another region may
// get the number of one that is gone.
void PlannedChanges::NoteCuts(const InstanceEntry& instance, Now now) {
  Change& change = changes_[instance.number];
  NoteUnprotected(instance, change, now);
  for (auto& [pair, until] : change.cuts) {
    const std::vector<RegionId> neighbors = instance.map.Neighbors(RegionId(pair.first));
    const bool adjoin = std::binary_search(neighbors.begin(), neighbors.end(), RegionId(pair.second));
    if (now.steady >= until && adjoin && !Hears(instance, pair.first, pair.second)) until = now.steady + kCutKept;
  }
  for (const CutLink& cut : instance.cut_links) change.cuts.try_emplace({cut.one, cut.other}, now.steady + kCutKept);
  const auto absent = [&](std::uint32_t region) { return IndexOf(instance, region) == instance.workers.size(); };
  std::erase_if(change.cuts, [&](const auto& entry) {
    return now.steady >= entry.second || absent(entry.first.first) || absent(entry.first.second);
  });
}

// Cuts a region from a standby that is there, but takes nothing of its primary's log, or not in time.
void PlannedChanges::NoteUnprotected(const InstanceEntry& instance, Change& change, Now now) {
  std::map<std::uint64_t, WorkerLoad> before = std::exchange(change.workers, {});
  for (const WorkerEntry& worker : instance.workers) {
    WorkerLoad& load = change.workers[worker.incarnation] = before[worker.incarnation];
    const std::uint32_t standby = StandbyOf(instance.record, worker.region);
    const std::size_t index = IndexOf(instance, standby);
    const bool waits = worker.report.phase() == v1::WORKER_PHASE_RUNNING && worker.report.unprotected() &&
                       standby != 0 && now.steady - worker.reported_at < settings_.failover_after &&
                       index < instance.workers.size() &&
                       !Silent(state_, instance, index, settings_.failover_after, now);
    if (!waits) {
      load.unprotected_since = Steady(0);
      continue;
    }
    if (load.unprotected_since.count() == 0) load.unprotected_since = now.steady;
    if (now.steady - load.unprotected_since < kStandbyPatience) continue;
    load.unprotected_since = now.steady;
    change.cuts[std::minmax(worker.region, standby)] = now.steady + kCutKept;
    state_.Log(absl::StrCat("standby takes nothing instance=", instance.record.id(), " region=", worker.region,
                            " standby=", standby));
  }
}

CutBetween PlannedChanges::CutsOf(const InstanceEntry& instance) const {
  const auto change = changes_.find(instance.number);
  if (change == changes_.end()) return [](RegionId, RegionId) { return false; };
  return [&cuts = change->second.cuts](RegionId a, RegionId b) {
    return cuts.contains(std::minmax(a.value(), b.value()));
  };
}

}  // namespace tessera::control
