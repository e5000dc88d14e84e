#include "control_plane/cluster/instance_checkpoints.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/branches.h"
#include "control_plane/change.h"
#include "control_plane/checkpoint_files.h"
#include "control_plane/cluster/host_rights.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/cluster/liveness.h"
#include "control_plane/control_settings.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/one_line.h"
#include "control_plane/world_terms.h"

namespace tessera::control {
namespace {

std::uint64_t NewestTick(const InstanceEntry& instance) {
  std::uint64_t newest = instance.newest_tick;
  for (const WorkerEntry& worker : instance.workers) newest = std::max(newest, worker.report.tick());
  return newest;
}

std::uint64_t SizeOf(const records::Instance& record) {
  std::uint64_t bytes = 0;
  for (const v1::Checkpoint& checkpoint : record.checkpoints()) bytes += checkpoint.size_bytes();
  return bytes;
}

// Rounded up: what is too much by a byte must not be reported as what is allowed.
std::uint64_t Megabytes(std::uint64_t bytes) { return (bytes + 999'999) / 1'000'000; }

constexpr char kBeingChanged[] = "who runs what is being changed";
// A region may miss the tick of one, by a link that is not up yet or by being late; what failed so often in a row will
// fail again.
constexpr int kFailuresUntilGivenUp = 5;

// Whether it was restored by itself, and has made few steps since.
bool DiesInARow(const InstanceEntry& instance) {
  const records::Restores& restores = instance.record.restores();
  if (restores.tick() == 0) return false;
  const auto forgiven = static_cast<std::uint64_t>(kRestoreForgiven.count()) * instance.record.tick_rate_hz();
  return NewestTick(instance) < restores.tick() + forgiven;
}

bool RunsUnchanged(const InstanceEntry& instance) {
  return instance.record.state() == v1::INSTANCE_STATE_RUNNING && AtRest(instance.record);
}

}  // namespace

// --- Making one.

absl::StatusOr<std::uint64_t> InstanceCheckpoints::Begin(InstanceEntry& instance, Now now) {
  if (const std::uint64_t tick = UnderWay(instance); tick != 0) return tick;
  if (!state_.checkpoint_trouble().empty()) return absl::ResourceExhaustedError(state_.checkpoint_trouble());
  if (!AtRest(instance.record)) {
    return absl::AbortedError(absl::StrCat("id: ", instance.record.id(), ": ", kBeingChanged, "; try again"));
  }
  if (IsPaused(instance.record)) return BeginStanding(instance, now);
  std::uint64_t newest = 0;
  for (const WorkerEntry& worker : instance.workers) newest = std::max(newest, TickOf(instance, worker, now));
  const auto lead = static_cast<std::uint64_t>(kPlanLead.count()) * instance.record.tick_rate_hz() / 1000;
  work_[instance.number].draft = Draft{newest + lead + 1, now.steady, instance.record.map().version(), {}};
  state_.MarkOrders(instance);
  return newest + lead + 1;
}

// All regions stand after the same tick.
absl::StatusOr<std::uint64_t> InstanceCheckpoints::BeginStanding(InstanceEntry& instance, Now now) {
  const std::uint64_t tick = NewestTick(instance);
  if (KeptOf(instance.record.checkpoints(), tick) != nullptr) {
    return absl::FailedPreconditionError(
        absl::StrCat("id: ", instance.record.id(), " is paused, and the checkpoint of tick ", tick, " is made"));
  }
  work_[instance.number].draft = Draft{tick, now.steady, instance.record.map().version(), {}};
  state_.MarkOrders(instance);
  return tick;
}

std::uint64_t InstanceCheckpoints::UnderWay(const InstanceEntry& instance) const {
  const auto work = work_.find(instance.number);
  return work != work_.end() && work->second.draft ? work->second.draft->tick : 0;
}

absl::Status InstanceCheckpoints::WhyNotMade(const InstanceEntry& instance) const {
  const auto work = work_.find(instance.number);
  return work == work_.end() ? absl::AbortedError("none was begun") : work->second.not_made;
}

// The draft that a file of `tick` belongs to. None while or after a failover, which leaves regions out that have sent
// theirs.
const InstanceCheckpoints::Draft* InstanceCheckpoints::DraftOf(const InstanceEntry& instance,
                                                               std::uint64_t tick) const {
  if (tick == 0 || UnderWay(instance) != tick) return nullptr;
  const Draft& draft = *work_.at(instance.number).draft;
  return draft.map_version == instance.record.map().version() && AtRest(instance.record) ? &draft : nullptr;
}

absl::Status InstanceCheckpoints::CheckQuota(std::uint64_t bytes) const {
  if (quota_ == 0 || bytes <= quota_) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("a checkpoint of ", Megabytes(bytes), " MB is larger than the ",
                                                   quota_ / 1'000'000,
                                                   " MB that those of a world may take (--checkpoint-quota-mb)"));
}

absl::Status InstanceCheckpoints::CheckUpload(const v1::UploadCheckpointRequest& request, Now now) {
  if (absl::Status status = CheckHostSecret(state_, request.host_id(), request.host_secret()); !status.ok()) {
    return status;
  }
  const v1::WorkerIdentity& identity = request.identity();
  InstanceEntry* instance = state_.FindInstance(identity.instance_id());
  const Draft* draft = instance == nullptr ? nullptr : DraftOf(*instance, request.tick());
  if (draft != nullptr) {
    const auto& placements = instance->record.placements();
    const bool placed = std::any_of(placements.begin(), placements.end(), [&](const records::Placement& placement) {
      return placement.region() == identity.region() && placement.host_id() == request.host_id() &&
             placement.incarnation() == identity.incarnation();
    });
    if (placed) {
      std::uint64_t bytes = request.size();
      for (const auto& [region, file] : draft->files) bytes += region == identity.region() ? 0 : file.size();
      const absl::Status fits = CheckQuota(bytes);
      if (!fits.ok()) NoteOverQuota(*instance, fits, now);
      return fits;
    }
  }
  return absl::FailedPreconditionError(absl::StrCat("tick: no checkpoint of tick ", request.tick(), " is being made"));
}

std::optional<records::Manifest> InstanceCheckpoints::NoteUploaded(const v1::UploadCheckpointRequest& request) {
  const InstanceEntry* instance = state_.FindInstance(request.identity().instance_id());
  if (instance == nullptr || DraftOf(*instance, request.tick()) == nullptr) return std::nullopt;
  Draft& draft = *work_.at(instance->number).draft;
  records::ManifestFile& file = draft.files[request.identity().region()];
  file.set_name(RegionFileName(request.identity().region()));
  file.set_size(request.size());
  file.set_hash(request.hash());
  if (draft.files.size() < instance->workers.size()) return std::nullopt;
  records::Manifest manifest;
  const records::Instance& record = instance->record;
  manifest.set_tick(request.tick());
  *manifest.mutable_map() = record.map();
  manifest.set_scene_hash(record.scene_hash());
  const GameName game = GameAfter(record, request.tick());
  manifest.set_game_name(game.name);
  manifest.set_game_hash(game.hash);
  manifest.set_game_native(record.game_native());
  if (record.has_movement()) *manifest.mutable_movement() = record.movement();
  v1::WorldTerms terms = TermsOf(record);
  terms.set_game(game.number);
  SetTerms(terms, *manifest.mutable_map());
  manifest.set_snapshot_rate_hz(record.snapshot_rate_hz());
  *manifest.mutable_borders() = record.borders();
  manifest.set_region_threads(record.region_threads());
  *manifest.mutable_branch() = record.branch();
  for (const auto& [region, entry] : draft.files) *manifest.add_files() = entry;
  *manifest.mutable_bodies() = record.bodies();
  return manifest;
}

// It is an error in the log each time, and an event once.
void InstanceCheckpoints::NoteOverQuota(InstanceEntry& instance, const absl::Status& why, Now now) {
  if (UnderWay(instance) != 0) Abandon(instance, why, now);
  work_[instance.number].next = Steady(0);  // no sooner than after another interval: it is as large again
  state_.Log(absl::StrCat("no checkpoint id=", instance.record.id(), ": ", why.message()), Severity::kError);
  if (std::exchange(instance.over_checkpoint_quota, true)) return;
  records::Instance next = instance.record;
  AddEvent(next, now, absl::StrCat("no checkpoint: ", why.message()));
  if (absl::Status status = state_.StoreInstance(instance, next); !status.ok()) {
    LogTrouble(state_, instance, "an event cannot be stored for now", status);
  }
  state_.MarkChanged(instance);
}

std::vector<std::uint64_t> InstanceCheckpoints::Prune(Work& work, records::Instance& next, Now now) const {
  std::vector<std::uint64_t> pruned;
  const auto drop = [&] {
    const int place = FirstToGo(next.checkpoints());
    pruned.push_back(next.checkpoints(place).tick());
    next.mutable_checkpoints()->DeleteSubrange(place, 1);
  };
  const auto keep = static_cast<int>(std::max(next.keep_checkpoints(), 1U));
  while (next.checkpoints_size() > keep) drop();
  if (next.checkpoints_size() == keep) work.fewer_said = false;
  bool fewer = false;
  for (; quota_ != 0 && next.checkpoints_size() > 1 && SizeOf(next) > quota_; fewer = true) drop();
  // Said when it begins, not with each one that is made.
  if (fewer && !std::exchange(work.fewer_said, true)) {
    AddEvent(next, now,
             absl::StrCat(next.checkpoints_size(), " of ", keep, " checkpoints are kept: more take over ",
                          quota_ / 1'000'000, " MB (--checkpoint-quota-mb)"));
  }
  return pruned;
}

void InstanceCheckpoints::NoteMade(InstanceEntry& instance, const records::Manifest& manifest, std::uint64_t size,
                                   Now now) {
  if (const absl::Status fits = CheckQuota(size); !fits.ok()) {
    state_.effects().pruned.emplace_back(instance.record.id(), manifest.tick());
    return NoteOverQuota(instance, fits, now);
  }
  if (UnderWay(instance) == manifest.tick()) work_[instance.number].draft.reset();
  work_[instance.number].failures = 0;
  records::Instance next = instance.record;
  // Its files have taken the place of those of a branch that was taken back.
  auto& listed = *next.mutable_checkpoints();
  listed.erase(std::remove_if(listed.begin(), listed.end(),
                              [&](const v1::Checkpoint& other) { return other.tick() == manifest.tick(); }),
               listed.end());
  v1::Checkpoint& checkpoint = *next.add_checkpoints();
  checkpoint.set_tick(manifest.tick());
  *checkpoint.mutable_branch() = manifest.branch();
  *checkpoint.mutable_create_time() = ToTimestamp(now.unix_time);
  checkpoint.set_regions(static_cast<std::uint32_t>(manifest.map().regions_size()));
  checkpoint.set_size_bytes(size);
  const std::vector<std::uint64_t> pruned = Prune(work_[instance.number], next, now);
  if (absl::Status status = state_.StoreInstance(instance, next); !status.ok()) {
    work_[instance.number].not_made = status;
    return LogTrouble(state_, instance, "checkpoint cannot be listed", status);
  }
  instance.over_checkpoint_quota = false;
  for (const std::uint64_t tick : pruned) state_.effects().pruned.emplace_back(instance.record.id(), tick);
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
}

void InstanceCheckpoints::Abandon(InstanceEntry& instance, const absl::Status& why, Now now) {
  Work& work = work_[instance.number];
  state_.effects().abandoned.emplace_back(instance.record.id(), work.draft->tick);
  state_.Log(
      absl::StrCat("checkpoint abandoned id=", instance.record.id(), " tick=", work.draft->tick, ": ", why.message()),
      Severity::kWarning);
  work.draft.reset();
  work.not_made = why;
  work.next = now.steady + kCheckpointRetry;
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
}

void InstanceCheckpoints::Step(InstanceEntry& instance, Now now) {
  Work& work = work_[instance.number];
  const records::Instance& record = instance.record;
  if (work.draft) {
    absl::Status why;
    std::string failure;
    if (!RunsUnchanged(instance) || work.draft->map_version != record.map().version()) {
      why = absl::AbortedError(kBeingChanged);
    }
    for (const WorkerEntry& worker : instance.workers) {
      // A worker reports the failure of an earlier one until it has heard of this.
      const bool heard = worker.report.order_revision() >= worker.order.revision() &&
                         worker.order.checkpoint().tick() == work.draft->tick;
      if (heard && !worker.report.checkpoint_failure().empty()) failure = worker.report.checkpoint_failure();
    }
    if (!failure.empty()) {
      const bool again = ++work.failures < kFailuresUntilGivenUp;
      why = again ? absl::AbortedError(failure) : absl::InternalError(failure);
    }
    if (now.steady - work.draft->since > kCheckpointTimeout) why = absl::DeadlineExceededError("timed out");
    if (!why.ok()) Abandon(instance, why, now);
    return;
  }
  if (!RunsUnchanged(instance) || record.checkpoint_interval_ms() == 0) return;
  const auto interval = std::chrono::milliseconds(record.checkpoint_interval_ms());
  if (work.next.count() == 0) work.next = now.steady + interval;
  if (now.steady < work.next) return;
  work.next = now.steady + interval;
  (void)Begin(instance, now);
}

// --- Worlds that are lost without one.

std::optional<records::Instance> InstanceCheckpoints::GiveUp(InstanceEntry& instance, Cause cause,
                                                             const std::string& why, Now now) {
  const records::Instance& record = instance.record;
  std::uint64_t before = 0;
  if (DiesInARow(instance) && record.restores().times() >= kMaxRestoresOfOne) before = record.restores().tick();
  if (NewestKeptBefore(record.checkpoints(), before) == nullptr) {
    const std::string stopped = before == 0
                                    ? why
                                    : absl::StrCat("it was lost ", record.restores().times(),
                                                   " times soon after it had begun from the checkpoint of tick ",
                                                   before, ", and there is no older one; the last time: ", why);
    return Failed(record, stopped, now);
  }
  Work& work = work_[instance.number];
  work.restore_before = before;
  work.died = cause == Cause::kDied;
  instance.restore_wanted = why;
  instance.restore_waits.clear();
  // At once where it has died; what was not to be had a moment ago will not be there now.
  work.restore_again_at = now.steady + kChangeRetry;
  if (work.died) state_.effects().restore.insert(record.id());
  state_.MarkChanged(instance);
  return std::nullopt;
}

std::uint64_t InstanceCheckpoints::RestoreBefore(const InstanceEntry& instance) const {
  const auto work = work_.find(instance.number);
  return work == work_.end() ? 0 : work->second.restore_before;
}

void InstanceCheckpoints::RetryRestore(const InstanceEntry& instance, Now now) {
  const auto work = work_.find(instance.number);
  if (instance.restore_wanted.empty() || work == work_.end() || now.steady < work->second.restore_again_at) return;
  work->second.restore_again_at = now.steady + kChangeRetry;
  state_.effects().restore.insert(instance.record.id());
}

void InstanceCheckpoints::NoteRestoreWaits(InstanceEntry& instance, const std::string& why) {
  std::string waits = OneLine(why, kMaxReasonBytes);
  if (waits == instance.restore_waits) return;
  instance.restore_waits = std::move(waits);
  state_.Log(absl::StrCat("restore waits id=", instance.record.id(), ": ", instance.restore_waits), Severity::kWarning);
  state_.MarkChanged(instance);
}

records::Instance InstanceCheckpoints::Restored(const InstanceEntry& instance, const records::Manifest& manifest,
                                                const PlacementPlan& placed, Now now) const {
  records::Instance next = RestoredFrom(instance.record, manifest, placed);
  const std::uint64_t newest = NewestTick(instance), lost = newest > manifest.tick() ? newest - manifest.tick() : 0;
  next.set_lost_ticks(next.lost_ticks() + lost);
  const bool at_least = newest == 0 || instance.newest_tick_is_kept;
  if (at_least) next.set_lost_ticks_at_least(true);
  if (at_least || lost > 0) *next.mutable_lost_time() = ToTimestamp(now.unix_time);
  const std::string amount =
      newest == 0 ? "nobody knows how many ticks are" : absl::StrCat(at_least ? "at least " : "", lost, " ticks");
  std::string text = absl::StrCat("restored from the checkpoint of tick ", manifest.tick(), ", ", amount, " lost");
  if (instance.restore_wanted.empty()) {
    next.clear_restores();
  } else {
    absl::StrAppend(&text, ": ", instance.restore_wanted);
    const auto work = work_.find(instance.number);
    const bool again = next.restores().tick() == manifest.tick() && DiesInARow(instance);
    const bool died = work != work_.end() && work->second.died;
    next.mutable_restores()->set_times(again ? next.restores().times() + (died ? 1 : 0) : 1);
    next.mutable_restores()->set_tick(manifest.tick());
  }
  AddEvent(next, now, text);
  next.set_reason(OneLine(text, kMaxReasonBytes));
  if (IsFinal(instance.record.state())) next.clear_end_time();
  return next;
}

void InstanceCheckpoints::Restarted(InstanceEntry& instance) {
  Work& work = work_[instance.number];
  work.restore_before = 0;
  instance.restore_wanted.clear();
  instance.restore_waits.clear();
  if (work.draft) work.not_made = absl::AbortedError("the world began anew");
  work.draft.reset();
}

absl::Status InstanceCheckpoints::Drop(InstanceEntry& instance) {
  if (instance.record.checkpoints().empty()) return absl::OkStatus();
  records::Instance next = instance.record;
  next.clear_checkpoints();
  const auto dropped = instance.record.checkpoints();
  if (absl::Status status = state_.StoreInstance(instance, next); !status.ok()) return status;
  for (const v1::Checkpoint& checkpoint : dropped) {
    state_.effects().pruned.emplace_back(instance.record.id(), checkpoint.tick());
  }
  state_.MarkChanged(instance);
  return absl::OkStatus();
}

// --- Reading.

absl::Status InstanceCheckpoints::CheckFetch(const v1::FetchStateRequest& request) const {
  if (absl::Status status = CheckHostSecret(state_, request.host_id(), request.host_secret()); !status.ok()) {
    return status;
  }
  if (absl::Status status = CheckMayFetchState(state_, request.host_id(), request.instance_id(), request.region());
      !status.ok()) {
    return status;
  }
  const InstanceEntry* instance = state_.FindInstance(request.instance_id());
  if (instance != nullptr && instance->record.restored().tick() == request.tick() && request.tick() != 0) {
    return absl::OkStatus();
  }
  return absl::NotFoundError(
      absl::StrCat("tick: ", request.instance_id(), " starts from no checkpoint ", request.tick()));
}

}  // namespace tessera::control
