#include "control_plane/cluster/instances.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/change.h"
#include "control_plane/cluster/free_hosts.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/cluster/instance_players.h"
#include "control_plane/cluster/views.h"
#include "control_plane/cluster/world_releases.h"
#include "control_plane/failover.h"
#include "control_plane/instance_record.h"
#include "control_plane/one_line.h"

namespace tessera::control {
namespace {

bool MayStillEnd(v1::InstanceState state) {
  return state == v1::INSTANCE_STATE_STOPPING || state == v1::INSTANCE_STATE_FAILED;
}

std::vector<WorkerFacts> FactsOfWorkers(const ClusterState& state, const InstanceEntry& instance) {
  std::vector<WorkerFacts> facts;
  facts.reserve(instance.workers.size());
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    const HostEntry* host = HostAt(state, instance, i);
    facts.push_back({worker.region, worker.report.phase(), host != nullptr && host->lost,
                     host != nullptr ? host->record.name() : "a removed host", worker.gone, worker.ending});
  }
  return facts;
}

}  // namespace

void Instances::Adopt(InstanceEntry& instance, Now now) const {
  const records::Instance& record = instance.record;
  const auto age = [&](const google::protobuf::Timestamp& since) {
    return std::max(now.unix_time - FromTimestamp(since),
                    std::chrono::nanoseconds(0));  // the wall clock may have been set back
  };
  instance.start_deadline =
      now.steady + std::chrono::milliseconds(record.start_deadline_ms()) - age(record.create_time());
  instance.state_since = IsFinal(record.state()) ? now.steady - age(record.end_time()) : now.steady;
}

// --- Steps.

LifeFacts Instances::Facts(const InstanceEntry& instance, int waiting, Now now) const {
  const bool pending = instance.record.state() == v1::INSTANCE_STATE_PENDING;
  const auto there = [&] {
    return pending ? waiting + static_cast<int>(instance.players.present()) : ConnectedEverywhere(instance);
  };
  LifeFacts facts;
  facts.workers = FactsOfWorkers(state_, instance);
  // A world that has run before and begins again waits for nobody: its players come back to it. Asked for each who
  // joins, so they are counted only where somebody is waited for.
  facts.players_ready = instance.record.has_start_time() || instance.record.expected_players() == 0 ||
                        there() >= static_cast<int>(instance.record.expected_players());
  facts.start_deadline_passed = now.steady >= instance.start_deadline;
  facts.start_timed_out = now.steady - instance.state_since >= settings_.start_timeout;
  return facts;
}

std::optional<records::Instance> Instances::NextInLife(const InstanceEntry& instance, int waiting, Now now) const {
  const records::Instance& record = instance.record;
  LifeStep step = NextStep(record.state(), record.run(), Facts(instance, waiting, now));
  if (step.state == record.state() && step.run == record.run()) return std::nullopt;
  records::Instance next = record;
  next.set_state(step.state);
  next.set_run(step.run);
  next.set_reason(std::move(step.reason));
  if (step.state == v1::INSTANCE_STATE_RUNNING) *next.mutable_start_time() = ToTimestamp(now.unix_time);
  if (IsFinal(step.state)) *next.mutable_end_time() = ToTimestamp(now.unix_time);
  return next;
}

std::optional<records::Instance> Instances::NextPlaced(const InstanceEntry& instance, Now now) const {
  const records::Instance& record = instance.record;
  const bool usable =
      std::all_of(record.placements().begin(), record.placements().end(), [this](const records::Placement& placement) {
        const HostEntry* host = state_.FindHost(placement.host_id());
        return host != nullptr && StateOf(*host) == v1::HOST_STATE_READY;
      });
  records::Instance next = record;
  if (!usable) {
    const auto placed = PlaceBeginning(state_, instance.map, NeedsOf(record), &instance, ReleaseChoice::kCommon,
                                       settings_.failover_after, now);
    if (!placed.ok()) {
      const bool late = now.steady - instance.state_since >= settings_.start_timeout;
      if (!late && record.reason() == placed.status().message()) return std::nullopt;
      if (late) {
        next.set_state(v1::INSTANCE_STATE_FAILED);
        *next.mutable_end_time() = ToTimestamp(now.unix_time);
      }
      next.set_reason(std::string(placed.status().message()));
      return next;
    }
    next = PlacedAnew(record, placed->placed);
    SetRelease(placed->release, now, next);
  }
  next.set_state(v1::INSTANCE_STATE_STARTING);
  next.clear_reason();
  return next;
}

std::optional<records::Instance> Instances::NextStopped(const InstanceEntry& instance) {
  const v1::InstanceState state = instance.record.state();
  if (state == v1::INSTANCE_STATE_STOPPING || IsFinal(state)) return std::nullopt;
  records::Instance next = instance.record;
  next.set_state(v1::INSTANCE_STATE_STOPPING);
  next.clear_reason();
  return next;
}

// --- What follows.

void Instances::Entered(InstanceEntry& instance, v1::InstanceState previous, Now now) {
  const v1::InstanceState state = instance.record.state();
  if (state != previous) {
    instance.state_since = now.steady;
    state_.Log(absl::StrCat("instance ", NameOf(previous), " -> ", NameOf(state), " id=", instance.record.id(),
                            " op=", instance.record.operation(), instance.record.reason().empty() ? "" : ": ",
                            instance.record.reason()),
               state == v1::INSTANCE_STATE_FAILED ? Severity::kError : Severity::kInfo);
  }
  if (!WantsWorkers(state)) instance.degraded.clear();
  if (MayStillEnd(state)) {
    const bool never_ordered = previous == v1::INSTANCE_STATE_PENDING || previous == v1::INSTANCE_STATE_PLACING;
    for (std::size_t i = 0; i < instance.workers.size(); ++i) {
      const HostEntry* host = HostAt(state_, instance, i);
      if (never_ordered || host == nullptr || host->lost) state_.SetGone(instance, instance.workers[i], "");
    }
  }
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
}

// How long it lasts is reported with it, so what is under way has a name that stays while it goes on.
void Instances::NoteWait(InstanceEntry& instance, Now now) const {
  const records::Instance& record = instance.record;
  std::string waits;
  if (!instance.restore_wanted.empty() && WantsWorkers(record.state())) {
    waits = "restore";
  } else if (record.has_failover()) {
    waits = "failover";
  } else if (record.has_planned() || !AtRest(record)) {
    waits = "change";
  } else if (IsStarting(record.state())) {
    waits = v1::InstanceState_Name(record.state());
  } else if (!instance.lacks_room.empty() && record.state() == v1::INSTANCE_STATE_RUNNING) {
    waits = "room";
  }
  if (waits == instance.waits) return LogProgress(instance, now);
  instance.waits = std::move(waits);
  instance.waits_since = now.unix_time;
  instance.progress_at = now.steady;
}

// Says the same as describe does of it.
void Instances::LogProgress(InstanceEntry& instance, Now now) const {
  if (instance.waits.empty() || now.steady - instance.progress_at < kProgressInterval) return;
  instance.progress_at = now.steady;
  const v1::Instance view = ViewOf(state_, instance);
  const auto minutes = std::chrono::duration_cast<std::chrono::minutes>(now.unix_time - instance.waits_since).count();
  state_.Log(absl::StrCat("still under way id=", instance.record.id(), " op=", instance.record.operation(), " minutes=",
                          minutes, ": ", view.changes().empty() ? instance.waits : view.changes(0).text()));
}

void Instances::NoteHealth(InstanceEntry& instance, Now now) {
  NoteWait(instance, now);
  const records::Instance& record = instance.record;
  const HealthFaults faults = health_.Look(instance, now);
  NoteFaults(instance, faults, now);
  std::vector<std::string> causes;
  if (record.has_failover()) causes.push_back(absl::StrCat("failover of ", DescribeFailover(record.failover())));
  if (record.state() == v1::INSTANCE_STATE_RUNNING) {
    if (!instance.unstored.empty()) causes.push_back(absl::StrCat("its next step is not stored: ", instance.unstored));
    causes.push_back(instance.awaits);
    causes.push_back(DegradedReason(FactsOfWorkers(state_, instance)));
    causes.push_back(faults.Text());
  }
  std::erase(causes, "");
  std::string degraded = OneLine(absl::StrJoin(causes, "; "), kMaxReasonBytes);
  if (degraded == instance.degraded) return;
  if (instance.degraded.empty()) instance.degraded_since = now.unix_time;
  if (degraded.empty()) {
    state_.Log(absl::StrCat("instance healthy id=", record.id()));
  } else {
    state_.Log(absl::StrCat("instance degraded id=", record.id(), ": ", degraded), Severity::kWarning);
  }
  instance.degraded = std::move(degraded);
  state_.MarkChanged(instance);
}

// One event for each kind of fault that begins: that further regions have it too is in the reason.
void Instances::NoteFaults(InstanceEntry& instance, const HealthFaults& faults, Now now) {
  const auto begins = [](const auto& fault, std::size_t before) { return !fault.empty() && before == 0; };
  const bool any = begins(faults.uncovered, instance.uncovered_regions) ||
                   begins(faults.still, instance.still_regions) || begins(faults.cut, instance.cut_links.size());
  instance.uncovered_regions = faults.uncovered.size();
  instance.still_regions = faults.still.size();
  instance.cut_links = faults.cut;
  if (!any) return;
  records::Instance next = instance.record;
  AddEvent(next, now, absl::StrCat("degraded: ", faults.Text()));
  if (absl::Status status = state_.StoreInstance(instance, next); !status.ok()) {
    LogTrouble(state_, instance, "an event cannot be stored for now", status);
  }
}

// --- Time.

void Instances::WithdrawLate(InstanceEntry& instance, Now now) {
  if (!MayStillEnd(instance.record.state()) || instance.withdrawn) return;
  if (now.steady - instance.state_since <= settings_.stop_grace) return;
  instance.withdrawn = true;
  state_.MarkOrders(instance);
}

std::vector<std::uint64_t> Instances::ForgetEnded(Now now) {
  std::vector<std::pair<Steady, std::uint64_t>> ended;  // oldest first
  for (const auto& [number, instance] : state_.instances()) {
    const bool quiet = std::all_of(instance.workers.begin(), instance.workers.end(),
                                   [](const WorkerEntry& worker) { return worker.gone; });
    // One that can be brought back from a checkpoint goes only when somebody deletes it.
    const bool restorable =
        instance.record.state() == v1::INSTANCE_STATE_FAILED && !instance.record.checkpoints().empty();
    if (IsFinal(instance.record.state()) && quiet && !restorable) ended.emplace_back(instance.state_since, number);
  }
  std::sort(ended.begin(), ended.end());
  std::vector<std::uint64_t> forgotten;
  for (const auto& [since, number] : ended) {
    const std::size_t kept = ended.size() - forgotten.size();
    if (kept <= kMaxEndedInstances && now.steady - since <= settings_.keep_ended) break;
    InstanceEntry& instance = state_.instance(number);
    const std::string id = instance.record.id();
    if (absl::Status status = state_.RemoveInstance(instance); !status.ok()) {
      LogTrouble(state_, instance, "instance cannot be forgotten for now", status);
      break;
    }
    state_.effects().instances.insert(id);
    state_.effects().forgotten.push_back(id);
    forgotten.push_back(number);
  }
  return forgotten;
}

}  // namespace tessera::control
