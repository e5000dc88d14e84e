#include "control_plane/cluster/cluster.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/free_hosts.h"
#include "control_plane/cluster/views.h"
#include "control_plane/game_deaths.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/report_limits.h"
#include "control_plane/world_terms.h"
#include "core/world/limits.h"
#include "core/world/partition_io.h"
#include "net/signing_key.h"

namespace tessera::control {
namespace {

absl::Status ModuleError(const InstancePlan& plan, const absl::Status& status) {
  return {status.code(), absl::StrCat(plan.game_native ? "spec.native_game: " : "spec.movement: ", status.message())};
}

// The needs that each region of a new instance has. A library of any build gets the one that the hosts have.
absl::StatusOr<RegionNeeds> NeedsOfPlan(const ClusterState& state, const InstancePlan& plan) {
  RegionNeeds needs{.threads = plan.region_threads};
  if (plan.game_native) {
    needs.module = plan.game_name;
    needs.build = plan.game_hash;
  } else if (plan.movement) {
    needs.module = plan.movement->name();
    needs.build = plan.movement->hash();
    needs.movement = true;
  }
  if (needs.module.empty() || !needs.build.empty()) return needs;
  auto build = BuildOfModule(state, needs);
  if (!build.ok()) return ModuleError(plan, build.status());
  needs.build = *std::move(build);
  return needs;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Cluster>> Cluster::Load(Store& store, const ControlSettings& settings,
                                                       RandomBytes random, Now now) {
  auto state = ClusterState::Load(store, settings.drop_set_aside);
  if (!state.ok()) return state.status();
  std::unique_ptr<Cluster> cluster(new Cluster(*std::move(state), settings, std::move(random), now));
  if (absl::Status status = cluster->LoadParts(now); !status.ok()) return status;
  cluster->recovery_.NoteHealth(now);
  return cluster;
}

Cluster::Cluster(std::unique_ptr<ClusterState> state, const ControlSettings& settings, RandomBytes random, Now now)
    : state_(std::move(state)),
      settings_(settings),
      random_(random),
      revocations_(*state_, random),
      hosts_(*state_, settings, random),
      tokens_(*state_, random),
      issuers_(*state_, std::move(random)),
      tickets_(*state_, issuers_),
      bans_(revocations_),
      reports_(*state_),
      instances_(*state_, settings),
      changes_(*state_, settings),
      failovers_(*state_, settings),
      checkpoints_(*state_, settings.checkpoint_quota),
      players_(*state_, settings),
      properties_(*state_),
      game_logs_(*state_),
      game_events_(*state_),
      game_messages_(*state_),
      visuals_(*state_, settings.visual_quota, settings.keep_visuals),
      reconciler_(*state_, {instances_, changes_, failovers_, checkpoints_, players_}),
      desired_sets_(*state_, revocations_,
                    [this](const InstanceEntry& instance) {
                      return Requests{checkpoints_.UnderWay(instance), properties_.Unanswered(instance),
                                      game_messages_.Unanswered(instance), game_events_.StoredUpTo(instance)};
                    }),
      recovery_(*state_, now) {
  for (HostEntry& host : state_->EachHost()) hosts_.Adopt(host, now);
  for (InstanceEntry& instance : state_->EachInstance()) Adopt(now, instance);
}

// A control plane that died while it restored an instance may not have said so to the backend.
absl::Status Cluster::LoadParts(Now now) {
  if (absl::Status status = revocations_.Load(); !status.ok()) return status;
  if (absl::Status status = tokens_.Load(); !status.ok()) return status;
  if (absl::Status status = issuers_.Load(); !status.ok()) return status;
  DropRevokedAccess();
  if (absl::Status status = tickets_.Load(now); !status.ok()) return status;
  if (absl::Status status = GiveSeeds(); !status.ok()) return status;
  if (!settings_.release.empty()) {
    if (absl::Status status = GiveReleases(*state_); !status.ok()) return status;
  }
  if (absl::Status status = visuals_.Load(); !status.ok()) return status;
  if (absl::Status status = game_events_.Load(); !status.ok()) return status;
  for (InstanceEntry& instance : state_->EachInstance()) game_events_.NoteRestore(instance, now);
  return game_messages_.Load();
}

// An instance of an earlier version has none. Its workers cannot go on, but it can be restored from a checkpoint.
absl::Status Cluster::GiveSeeds() {
  for (InstanceEntry& instance : state_->EachInstance()) {
    if (!instance.record.signing_seed().empty() || instance.record.state() == v1::INSTANCE_STATE_ENDED) continue;
    records::Instance next = instance.record;
    next.set_signing_seed(random_(net::kKeyBytes));
    if (absl::Status status = state_->StoreInstance(instance, next); !status.ok()) return status;
  }
  return absl::OkStatus();
}

// The control plane before this one may have renewed every worker's lease a moment ago.
void Cluster::Adopt(Now now, InstanceEntry& instance) {
  for (WorkerEntry& worker : instance.workers) worker.leased_at = now.steady;
  instances_.Adopt(instance, now);
  failovers_.Adopt(instance, now);
}

void Cluster::Forget(std::uint64_t number) {
  instances_.Forget(number);
  changes_.Forget(number);
  failovers_.Forget(number);
  checkpoints_.Forget(number);
  players_.Forget(number);
  properties_.Forget(number);
  game_logs_.Forget(number);
  game_events_.Forget(number);
  game_messages_.Forget(number);
  upgrades_.Forget(number);
  bans_.ForgetInstance(absl::StrCat(kInstanceId, number));
}

// --- Hosts.

absl::StatusOr<v1::AddHostResponse> Cluster::AddHost(Now now, const v1::AddHostRequest& request) {
  return hosts_.Add(request, now);
}

absl::StatusOr<v1::DrainHostResponse> Cluster::DrainHost(const v1::DrainHostRequest& request) {
  return hosts_.Drain(request);
}

absl::Status Cluster::RemoveHost(Now now, const v1::RemoveHostRequest& request) {
  const auto host = hosts_.FindRemovable(request);
  if (!host.ok()) return host.status();
  if (request.validate_only()) return absl::OkStatus();
  // The list first: from then on it is certain, whatever fails.
  if (absl::Status status = revocations_.AddHost(**host); !status.ok()) return status;
  InstanceNumbers touched;
  const absl::Status removed = hosts_.Remove(**host, touched);
  reconciler_.Reconcile(now, touched);
  return removed;
}

// --- Instances.

absl::StatusOr<v1::Instance> Cluster::CreateInstance(Now now, const InstancePlan& plan, bool validate_only) {
  if (const InstanceEntry* made = state_->FindByRequestId(plan.request_id)) return ViewOf(*state_, *made);
  // Whoever only asks has not sent them yet. A world that comes out of a checkpoint matters more than its look.
  if (!validate_only && !plan.restored) {
    if (absl::Status status = visuals_.CheckThere(plan.visuals); !status.ok()) return status;
  }
  const auto needs = NeedsOfPlan(*state_, plan);
  if (!needs.ok()) return needs.status();
  const auto placed =
      PlaceBeginning(*state_, plan.map, *needs, nullptr, ReleaseChoice::kCommon, settings_.failover_after, now);
  if (absl::IsFailedPrecondition(placed.status())) return ModuleError(plan, placed.status());
  if (!placed.ok()) return placed.status();
  records::Instance record = NewInstance(plan, placed->placed, now);
  record.set_release(placed->release);
  if (plan.game_native) record.set_game_hash(needs->build);
  if (plan.movement) record.mutable_movement()->set_hash(needs->build);
  if (validate_only) {
    InstanceEntry draft;
    draft.record = std::move(record);
    draft.record.set_state(v1::INSTANCE_STATE_PENDING);
    return ViewOf(*state_, draft);
  }
  record.set_signing_seed(random_(net::kKeyBytes));
  const auto added = state_->AddInstance(std::move(record), plan.contents);
  if (!added.ok()) return added.status();
  InstanceEntry& instance = **added;
  Adopt(now, instance);
  state_->Log(absl::StrCat("instance made id=", instance.record.id(), " op=", instance.record.operation(), " scene=",
                           plan.scene_name, plan.game_name.empty() ? "" : absl::StrCat(" game=", plan.game_name),
                           " regions=", instance.workers.size(), " state=", NameOf(instance.record.state())));
  state_->MarkOrders(instance);
  state_->MarkChanged(instance);
  reconciler_.Reconcile(now, instance);
  return ViewOf(*state_, instance);
}

absl::StatusOr<v1::Instance> Cluster::DeleteInstance(Now now, const v1::DeleteInstanceRequest& request) {
  InstanceEntry* instance = state_->FindInstance(request.id());
  if (instance == nullptr) return DeleteUnknown(request);
  if (request.validate_only()) return ViewOf(*state_, *instance);
  if (const auto next = Instances::NextStopped(*instance)) {
    if (absl::Status status = reconciler_.Enter(now, *instance, *next); !status.ok()) return status;
    reconciler_.Reconcile(now, *instance);
  } else if (instance->record.state() == v1::INSTANCE_STATE_FAILED) {
    if (absl::Status status = checkpoints_.Drop(*instance); !status.ok()) return status;
  }
  return ViewOf(*state_, *instance);
}

// A world that runs on, of which a restored store has no record: its workers alone are known.
absl::StatusOr<v1::Instance> Cluster::DeleteUnknown(const v1::DeleteInstanceRequest& request) {
  v1::Instance view;
  view.set_id(request.id());
  view.set_state(v1::INSTANCE_STATE_STOPPING);
  view.set_reason("it is not known to this control plane; its workers end");
  const auto& hosts = state_->hosts();
  const bool runs = std::any_of(hosts.begin(), hosts.end(), [&request](const auto& host) {
    const auto& unknown = host.second.record.unknown_workers();
    return std::any_of(unknown.begin(), unknown.end(),
                       [&request](const v1::WorkerOrder& order) { return order.instance_id() == request.id(); });
  });
  if (!runs) return NoInstance("id", request.id());
  if (request.validate_only()) return view;
  if (const auto forgotten = ForgetUnknown(*state_, request.id()); !forgotten.ok()) return forgotten.status();
  return view;
}

absl::StatusOr<v1::Instance> Cluster::ScaleInstance(Now now, const v1::ScaleInstanceRequest& request) {
  if (request.regions() < 1 || request.regions() > kMaxRegions) {
    return absl::InvalidArgumentError(absl::StrCat("regions: ", request.regions(), " is not in 1 to ", kMaxRegions));
  }
  const auto found = FindRunning(*state_, request.id());
  if (!found.ok()) return found.status();
  return Ask(now, **found, changes_.Scale(**found, request.regions(), now), request.validate_only());
}

absl::StatusOr<v1::Instance> Cluster::RestartWorkers(Now now, const v1::RestartWorkersRequest& request) {
  const auto found = FindRunning(*state_, request.id());
  if (!found.ok()) return found.status();
  return Ask(now, **found, changes_.Restart(**found, now), request.validate_only());
}

absl::StatusOr<v1::Instance> Cluster::PauseInstance(Now now, const v1::PauseInstanceRequest& request) {
  const auto found = FindRunning(*state_, request.id());
  if (!found.ok()) return found.status();
  return Ask(now, **found, PlannedChanges::Pause(**found, true, now), request.validate_only());
}

absl::StatusOr<v1::Instance> Cluster::ResumeInstance(Now now, const v1::ResumeInstanceRequest& request) {
  const auto found = FindRunning(*state_, request.id());
  if (!found.ok()) return found.status();
  const auto next = request.ticks() == 0
                        ? absl::StatusOr<std::optional<records::Instance>>(PlannedChanges::Pause(**found, false, now))
                        : PlannedChanges::MakeTicks(**found, request.ticks(), now);
  return Ask(now, **found, next, request.validate_only());
}

absl::StatusOr<v1::Instance> Cluster::SetPace(Now now, const v1::SetPaceRequest& request) {
  const auto found = FindRunning(*state_, request.id());
  if (!found.ok()) return found.status();
  return Ask(now, **found, PlannedChanges::SetPace(**found, request.ticks_per_second(), now), request.validate_only());
}

absl::StatusOr<v1::Instance> Cluster::SetGame(Now now, const v1::SetGameRequest& request, const std::string& hash) {
  const auto found = FindRunning(*state_, request.id());
  if (!found.ok()) return found.status();
  const Contents contents{.scene = {}, .game = request.game().content()};
  return Ask(now, **found, PlannedChanges::SetGame(**found, request.game().name(), hash, now), request.validate_only(),
             contents);
}

// Stores what was asked for of a running instance, if it is anything new.
absl::StatusOr<v1::Instance> Cluster::Ask(Now now, InstanceEntry& instance,
                                          const absl::StatusOr<std::optional<records::Instance>>& next,
                                          bool validate_only, const Contents& contents) {
  if (!next.ok()) return next.status();
  if (!validate_only && next->has_value()) {
    if (absl::Status status = state_->StoreInstance(instance, **next, contents); !status.ok()) return status;
    changes_.Hasten(instance.number);
    state_->MarkOrders(instance);
    state_->MarkChanged(instance);
    reconciler_.Reconcile(now, instance);
  }
  return ViewOf(*state_, instance);
}

// --- Properties.

absl::StatusOr<std::uint64_t> Cluster::SetProperty(const v1::SetPropertyRequest& request) {
  const auto found = FindRunning(*state_, request.id());
  if (!found.ok()) return found.status();
  if (IsPaused((*found)->record)) {
    return absl::FailedPreconditionError(
        absl::StrCat("id: ", request.id(), " is paused, and properties change with ticks"));
  }
  return properties_.Add(**found, request);
}

std::optional<absl::Status> Cluster::PropertyOutcome(const std::string& id, std::uint64_t change) const {
  return properties_.Outcome(id, change);
}

void Cluster::ForgetProperty(const std::string& id, std::uint64_t change) {
  if (InstanceEntry* instance = state_->FindInstance(id)) properties_.Remove(*instance, change);
}

// --- Games.

absl::StatusOr<v1::ListGameLinesResponse> Cluster::ListGameLines(const v1::ListGameLinesRequest& request) const {
  const InstanceEntry* instance = state().FindInstance(request.id());
  if (instance == nullptr) return NoInstance("id", request.id());
  if (instance->record.game_hash().empty()) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", instance->record.id(), " runs no game"));
  }
  v1::ListGameLinesResponse response;
  for (v1::GameLogLine& line : game_logs_.After(*instance, request.after())) *response.add_lines() = std::move(line);
  return response;
}

absl::StatusOr<std::vector<v1::PublishedEvent>> Cluster::GameEventsAfter(const std::string& id,
                                                                         std::uint64_t number) const {
  const InstanceEntry* instance = state().FindInstance(id);
  if (instance == nullptr) return NoInstance("id", id);
  if (instance->record.game_hash().empty()) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", instance->record.id(), " runs no game"));
  }
  return game_events_.After(*instance, number, kPublishedAtOnce);
}

// A request that was made before is answered for also while the instance does not run.
absl::StatusOr<std::uint64_t> Cluster::SendToGame(Now now, const v1::SendToGameRequest& request) {
  const InstanceEntry* instance = state().FindInstance(request.id());
  if (instance == nullptr) return NoInstance("id", request.id());
  if (const std::uint64_t number = game_messages_.Find(*instance, request.request_id()); number != 0) return number;
  const auto found = FindRunning(*state_, request.id());
  if (!found.ok()) return found.status();
  if (instance->record.game_hash().empty()) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", instance->record.id(), " runs no game"));
  }
  return game_messages_.Add(**found, request, now);
}

std::optional<absl::Status> Cluster::GameMessageOutcome(const std::string& id, std::uint64_t number) const {
  return game_messages_.Outcome(id, number);
}

// --- Checkpoints.

absl::StatusOr<std::uint64_t> Cluster::BeginCheckpoint(Now now, const std::string& id) {
  const auto found = FindRunning(*state_, id);
  if (!found.ok()) return found.status();
  return checkpoints_.Begin(**found, now);
}

std::uint64_t Cluster::CheckpointUnderWay(const std::string& id) const {
  const InstanceEntry* instance = state().FindInstance(id);
  return instance == nullptr ? 0 : checkpoints_.UnderWay(*instance);
}

absl::Status Cluster::WhyNoCheckpoint(const std::string& id) const {
  const InstanceEntry* instance = state().FindInstance(id);
  return instance == nullptr ? NoInstance("id", id) : checkpoints_.WhyNotMade(*instance);
}

absl::Status Cluster::CheckUpload(Now now, const v1::UploadCheckpointRequest& request) {
  return checkpoints_.CheckUpload(request, now);
}

std::optional<records::Manifest> Cluster::NoteUploaded(const v1::UploadCheckpointRequest& request) {
  return checkpoints_.NoteUploaded(request);
}

void Cluster::NoteCheckpoint(Now now, const std::string& id, const records::Manifest& manifest, std::uint64_t size) {
  if (InstanceEntry* instance = state_->FindInstance(id)) checkpoints_.NoteMade(*instance, manifest, size, now);
}

absl::Status Cluster::CheckFetch(const v1::FetchStateRequest& request) const {
  return checkpoints_.CheckFetch(request);
}

// The workers of before are in no desired set any more, and end.
absl::StatusOr<v1::Instance> Cluster::Restore(Now now, const std::string& id, const records::Manifest& manifest,
                                              const Contents& contents, bool validate_only, ReleaseChoice release) {
  InstanceEntry* instance = state_->FindInstance(id);
  if (instance == nullptr) return NoInstance("id", id);
  const v1::InstanceState state = instance->record.state();
  const bool begins_again = state == v1::INSTANCE_STATE_STARTING && !instance->restore_wanted.empty();
  if (state != v1::INSTANCE_STATE_RUNNING && state != v1::INSTANCE_STATE_FAILED && !begins_again) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", id, " neither runs nor has failed"));
  }
  const auto map = FromProto(manifest.map());
  if (!map.ok()) return map.status();
  const auto placed =
      PlaceBeginning(*state_, *map, NeedsOf(instance->record), instance, release, settings_.failover_after, now);
  if (!placed.ok()) return placed.status();
  if (validate_only) return ViewOf(*state_, *instance);
  records::Instance next = checkpoints_.Restored(*instance, manifest, placed->placed, now);
  const bool time_lost =
      next.lost_ticks() != instance->record.lost_ticks() || instance->newest_tick == 0 || instance->newest_tick_is_kept;
  SetRelease(placed->release, now, next);
  if (IsFinal(state)) {
    if (absl::Status status = state_->ReuseContents(next, contents); !status.ok()) return status;
  }
  if (absl::Status status = state_->StoreInstance(*instance, next, contents); !status.ok()) return status;
  if (time_lost && !instance->restore_wanted.empty()) {  // else somebody asked for it, and knows
    state_->Log(absl::StrCat("time lost id=", id, ": ", instance->record.reason()), Severity::kError);
  }
  instances_.Restarted(*instance, now);
  checkpoints_.Restarted(*instance);
  instance->newest_tick = manifest.tick();
  instance->newest_tick_is_kept = false;
  properties_.Forget(instance->number);  // they were for the world before
  game_events_.NoteRestore(*instance, now);
  failovers_.Forget(instance->number);
  instances_.Entered(*instance, state, now);
  reconciler_.Reconcile(now, *instance);
  return ViewOf(*state_, *instance);
}

std::optional<std::uint64_t> Cluster::RestoreWantedBefore(const std::string& id) const {
  const InstanceEntry* instance = state().FindInstance(id);
  if (instance == nullptr || instance->restore_wanted.empty() || !WantsWorkers(instance->record.state())) {
    return std::nullopt;  // it was stopped meanwhile
  }
  return checkpoints_.RestoreBefore(*instance);
}

void Cluster::NoteRestoreWaits(const std::string& id, const std::string& why) {
  InstanceEntry* instance = state_->FindInstance(id);
  if (instance != nullptr && !instance->restore_wanted.empty()) checkpoints_.NoteRestoreWaits(*instance, why);
}

void Cluster::CannotRestore(Now now, const std::string& id, const std::string& why) {
  InstanceEntry* instance = state_->FindInstance(id);
  if (instance == nullptr || IsFinal(instance->record.state())) return;
  const std::string wanted = instance->restore_wanted;
  if (wanted.empty()) return;
  if (!reconciler_.Enter(now, *instance, Failed(instance->record, absl::StrCat(wanted, "; ", why), now)).ok()) return;
  checkpoints_.Restarted(*instance);
}

}  // namespace tessera::control
