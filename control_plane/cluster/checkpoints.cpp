// Checkpoints: when they are made, of what they consist, and how a world starts again from one. The files are
// ControlPlane's.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/checkpoint_files.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/orders.h"
#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

std::uint64_t NewestTick(const InstanceEntry& instance) {
  std::uint64_t newest = 0;
  for (const WorkerEntry& worker : instance.workers) newest = std::max(newest, worker.report.tick());
  return newest;
}

// Not while or after a failover, which leaves regions out that have sent theirs.
bool Awaits(const InstanceEntry& instance, std::uint64_t tick) {
  return instance.checkpoint && instance.checkpoint->tick == tick &&
         instance.checkpoint->map_version == instance.record.map().version() && AtRest(instance.record);
}

}  // namespace

absl::StatusOr<std::uint64_t> Cluster::BeginCheckpoint(Moment now, const std::string& id) {
  const auto found = FindRunning(id);
  if (!found.ok()) return found.status();
  InstanceEntry& instance = **found;
  if (instance.checkpoint) return instance.checkpoint->tick;
  if (!AtRest(instance.record)) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", id, ": who runs what is being changed; try again"));
  }
  std::uint64_t newest = 0;
  for (const RegionFacts& region : ChangeFacts(now, instance)) newest = std::max(newest, region.tick);
  const auto lead = static_cast<std::uint64_t>(kPlanLead.count()) * instance.record.tick_rate_hz() / 1000;
  instance.checkpoint = CheckpointDraft{newest + lead + 1, now.steady, instance.record.map().version(), {}};
  MarkOrders(instance);
  return instance.checkpoint->tick;
}

absl::Status Cluster::CheckUpload(const v1::UploadCheckpointRequest& request) const {
  if (absl::Status status = CheckHostSecret(request.host_id(), request.host_secret()); !status.ok()) return status;
  const InstanceEntry* instance = FindInstance(request.identity().instance_id());
  const bool wanted = instance != nullptr && Awaits(*instance, request.tick());
  const auto& placements =
      instance == nullptr ? records::Instance::default_instance().placements() : instance->record.placements();
  const bool placed = std::any_of(placements.begin(), placements.end(), [&](const records::Placement& placement) {
    return placement.region() == request.identity().region() && placement.host_id() == request.host_id() &&
           placement.incarnation() == request.identity().incarnation();
  });
  if (wanted && placed) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("tick: no checkpoint of tick ", request.tick(), " is being made"));
}

std::optional<records::Manifest> Cluster::NoteUploaded(const v1::UploadCheckpointRequest& request) {
  InstanceEntry* instance = FindInstance(request.identity().instance_id());
  if (instance == nullptr || !Awaits(*instance, request.tick())) return std::nullopt;
  records::ManifestFile& file = instance->checkpoint->files[request.identity().region()];
  file.set_name(RegionFileName(request.identity().region()));
  file.set_size(request.size());
  file.set_hash(request.hash());
  if (instance->checkpoint->files.size() < instance->workers.size()) return std::nullopt;
  records::Manifest manifest;
  const records::Instance& record = instance->record;
  manifest.set_tick(request.tick());
  *manifest.mutable_map() = record.map();
  manifest.set_scene_hash(record.scene_hash());
  manifest.set_snapshot_rate_hz(record.snapshot_rate_hz());
  *manifest.mutable_borders() = record.borders();
  for (const auto& [region, entry] : instance->checkpoint->files) *manifest.add_files() = entry;
  *manifest.mutable_bodies() = record.bodies();
  return manifest;
}

void Cluster::NoteCheckpoint(Moment now, const std::string& id, const records::Manifest& manifest, std::uint64_t size) {
  InstanceEntry* instance = FindInstance(id);
  if (instance == nullptr) return;
  if (instance->checkpoint && instance->checkpoint->tick == manifest.tick()) instance->checkpoint.reset();
  records::Instance next = instance->record;
  v1::Checkpoint& checkpoint = *next.add_checkpoints();
  checkpoint.set_tick(manifest.tick());
  *checkpoint.mutable_create_time() = ToTimestamp(now.unix_time);
  checkpoint.set_regions(static_cast<std::uint32_t>(manifest.map().regions_size()));
  checkpoint.set_size_bytes(size);
  std::vector<std::uint64_t> pruned;
  const auto keep = static_cast<int>(std::max(next.keep_checkpoints(), 1u));
  while (next.checkpoints_size() > keep) {
    pruned.push_back(next.checkpoints(0).tick());
    next.mutable_checkpoints()->DeleteSubrange(0, 1);
  }
  if (absl::Status status = StoreInstance(*instance, next); !status.ok()) {
    return NoteTrouble(*instance, "checkpoint cannot be listed", status);
  }
  for (const std::uint64_t tick : pruned) effects_.pruned.emplace_back(id, tick);
  MarkOrders(*instance);
  Changed(*instance);
}

void Cluster::AbandonCheckpoint(Moment now, InstanceEntry& instance, const std::string& why) {
  effects_.abandoned.emplace_back(instance.record.id(), instance.checkpoint->tick);
  effects_.log.push_back(
      absl::StrCat("checkpoint abandoned id=", instance.record.id(), " tick=", instance.checkpoint->tick, ": ", why));
  instance.checkpoint.reset();
  instance.next_checkpoint = now.steady + kCheckpointRetry;
  MarkOrders(instance);
  Changed(instance);
}

std::uint64_t Cluster::CheckpointUnderWay(const std::string& id) const {
  const InstanceEntry* instance = FindInstance(id);
  return instance != nullptr && instance->checkpoint ? instance->checkpoint->tick : 0;
}

std::string Cluster::SceneHashOf(const std::string& id) const {
  const InstanceEntry* instance = FindInstance(id);
  return instance == nullptr ? "" : instance->record.scene_hash();
}

// Called by the timer.
void Cluster::StepCheckpoint(Moment now, InstanceEntry& instance) {
  const records::Instance& record = instance.record;
  const bool runs = record.state() == v1::INSTANCE_STATE_RUNNING && AtRest(record);
  if (instance.checkpoint) {
    std::string why;
    if (!runs || instance.checkpoint->map_version != record.map().version()) why = "who runs what is being changed";
    for (const WorkerEntry& worker : instance.workers) {
      // Of an earlier one it tells until it has heard of this.
      const bool heard = worker.report.order_revision() >= worker.order.revision() &&
                         worker.order.checkpoint().tick() == instance.checkpoint->tick;
      if (heard && !worker.report.checkpoint_failure().empty()) why = worker.report.checkpoint_failure();
    }
    if (now.steady - instance.checkpoint->since > kCheckpointTimeout) why = "timed out";
    if (!why.empty()) AbandonCheckpoint(now, instance, why);
    return;
  }
  if (!runs || record.checkpoint_interval_ms() == 0) return;
  if (instance.next_checkpoint.count() == 0) {
    instance.next_checkpoint = now.steady + std::chrono::milliseconds(record.checkpoint_interval_ms());
  }
  if (now.steady < instance.next_checkpoint) return;
  instance.next_checkpoint = now.steady + std::chrono::milliseconds(record.checkpoint_interval_ms());
  (void)BeginCheckpoint(now, record.id());
}

absl::Status Cluster::CheckFetch(const v1::FetchStateRequest& request) const {
  if (absl::Status status = CheckHostSecret(request.host_id(), request.host_secret()); !status.ok()) return status;
  const InstanceEntry* instance = FindInstance(request.instance_id());
  if (instance != nullptr && instance->record.restored().tick() == request.tick() && request.tick() != 0) {
    return absl::OkStatus();
  }
  return absl::NotFoundError(
      absl::StrCat("tick: ", request.instance_id(), " starts from no checkpoint ", request.tick()));
}

// All start again. Their predecessors are in no desired set any more, and end.
absl::StatusOr<v1::Instance> Cluster::Restore(Moment now, const std::string& id, const records::Manifest& manifest,
                                              const std::string& scene, bool validate_only) {
  InstanceEntry* instance = FindInstance(id);
  if (instance == nullptr) return absl::NotFoundError(absl::StrCat("id: no instance ", OneLine(id, kMaxNameBytes)));
  const v1::InstanceState state = instance->record.state();
  if (state != v1::INSTANCE_STATE_RUNNING && state != v1::INSTANCE_STATE_FAILED) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", id, " neither runs nor has failed"));
  }
  const auto map = FromProto(manifest.map());
  if (!map.ok()) return map.status();
  const auto placed = PlaceAnew(now, *map, instance);
  if (!placed.ok()) return placed.status();
  if (validate_only) return View(*instance, true);
  records::Instance next = instance->record;
  SetRestored(*placed, manifest, next);
  const std::uint64_t newest = NewestTick(*instance), lost = newest > manifest.tick() ? newest - manifest.tick() : 0;
  next.set_lost_ticks(next.lost_ticks() + lost);
  std::string text = absl::StrCat("restored from the checkpoint of tick ", manifest.tick(), ", ", lost, " ticks lost");
  if (!instance->restore_wanted.empty()) absl::StrAppend(&text, ": ", instance->restore_wanted);
  AddEvent(next, now, text);
  next.set_reason(OneLine(text, kMaxReasonBytes));
  if (IsFinal(state)) {
    next.clear_end_time();
    if (absl::Status status = BringBackScene(next.scene_hash(), scene); !status.ok()) return status;
  }
  if (absl::Status status = StoreInstance(*instance, next); !status.ok()) return status;
  instance->restore_wanted.clear();
  instance->withdrawn = false;
  instance->checkpoint.reset();
  instance->property_changes.clear();  // of the world before
  instance->failover = {};
  Assign(*instance);
  Entered(now, *instance, state);
  Reconcile(now, *instance);
  return View(*instance, true);
}

void Cluster::SetRestored(const PlacementPlan& placed, const records::Manifest& manifest, records::Instance& next) {
  next.clear_placements();
  for (const PlacedRegion& region : placed.regions) {
    records::Placement& placement = *next.add_placements();
    placement.set_region(region.region.value());
    placement.set_host_id(region.host_id);
    placement.set_incarnation(next.last_incarnation() + 1);
    next.set_last_incarnation(placement.incarnation());
  }
  const std::uint64_t version = std::max(next.last_map_version(), next.map().version()) + 1;
  *next.mutable_map() = ToProto(placed.map);
  next.mutable_map()->set_version(version);
  next.set_last_map_version(version);
  next.set_state(v1::INSTANCE_STATE_STARTING);
  next.set_run(false);
  next.clear_failover();
  next.clear_planned();
  records::Restored& restored = *next.mutable_restored();
  restored.Clear();
  restored.set_tick(manifest.tick());
  restored.set_last_incarnation(next.last_incarnation());
  for (const PlacedRegion& region : placed.regions) {
    for (const records::ManifestFile& file : manifest.files()) {
      if (file.name() != RegionFileName(region.region.value())) continue;
      records::RegionFile& added = *restored.add_files();
      added.set_region(region.region.value());
      added.set_hash(file.hash());
    }
  }
}

absl::Status Cluster::BringBackScene(const std::string& hash, const std::string& scene) {
  if (!scenes_.contains(hash)) {
    const auto stored = store_.Put(SceneKey(hash), scene, kAbsent);
    if (!stored.ok()) return absl::UnavailableError(stored.status().message());
    scenes_[hash].revision = *stored;
  }
  ++scenes_[hash].instances;
  return absl::OkStatus();
}

void Cluster::CannotRestore(Moment now, const std::string& id, const std::string& why) {
  InstanceEntry* instance = FindInstance(id);
  if (instance == nullptr || instance->restore_wanted.empty() || IsFinal(instance->record.state())) return;
  records::Instance next = instance->record;
  const v1::InstanceState previous = next.state();
  next.set_state(v1::INSTANCE_STATE_FAILED);
  next.set_reason(OneLine(absl::StrCat(instance->restore_wanted, "; ", why), kMaxReasonBytes));
  next.clear_failover();
  next.clear_planned();
  *next.mutable_end_time() = ToTimestamp(now.unix_time);
  if (!StoreInstance(*instance, next).ok()) return;
  instance->restore_wanted.clear();
  Entered(now, *instance, previous);
}

absl::StatusOr<v1::ListCheckpointsResponse> Cluster::ListCheckpoints(const v1::ListCheckpointsRequest& request) const {
  const InstanceEntry* instance = FindInstance(request.id());
  if (instance == nullptr) {
    return absl::NotFoundError(absl::StrCat("id: no instance ", OneLine(request.id(), kMaxNameBytes)));
  }
  v1::ListCheckpointsResponse response;
  *response.mutable_checkpoints() = instance->record.checkpoints();
  return response;
}

}  // namespace tessera::control
