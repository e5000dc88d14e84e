// ControlPlane's part in checkpoints: the files, and the calls that wait for them.
#include <spdlog/spdlog.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/bundle.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/control_plane.h"
#include "control_plane/id_ranges.h"
#include "control_plane/message_cost.h"
#include "control_plane/one_line.h"
#include "control_plane/stored_records.h"
#include "core/world/partition_io.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kNamedStrays = 20;  // worlds, in the log; the others are counted

void AddFile(const char* name, const std::string& bytes, records::Manifest& manifest) {
  records::ManifestFile& file = *manifest.add_files();
  file.set_name(name);
  file.set_size(bytes.size());
  file.set_hash(Sha256Hex(bytes));
}

// A target that does not answer, refuses us or has no room, which an operator can mend: a restore waits for it.
bool MayPass(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsPermissionDenied(status) || absl::IsResourceExhausted(status);
}

absl::Status NoFiles() { return absl::FailedPreconditionError("this control plane keeps no checkpoints"); }

}  // namespace

absl::StatusOr<DraftFile> ControlPlane::NewDraft() const {
  if (!files_) return NoFiles();
  return files_->NewDraft();
}

absl::Status ControlPlane::AppendTo(DraftFile& draft, const std::string& piece) const {
  if (absl::Status room = files_->CheckRoom(piece.size()); !room.ok()) return room;
  return draft.Append(piece);
}

absl::Status ControlPlane::TakeUpload(const v1::UploadCheckpointRequest& request, const DraftFile& file) {
  absl::Status status = Call([&](Cluster& cluster, Now now) { return cluster.CheckUpload(now, request); });
  if (!status.ok()) return status;
  const std::string& id = request.identity().instance_id();
  const auto hash = file.Hash(0, file.size());
  if (!hash.ok()) return hash.status();
  if (file.size() != request.size() || *hash != request.hash()) {
    return absl::InvalidArgumentError("data: has not the size and hash that were announced");
  }
  {
    const std::lock_guard one_in_memory(uploads_mutex_);
    const auto bytes = file.Read(0, file.size());
    if (!bytes.ok()) return bytes.status();
    status = files_->Put(id, request.tick(), RegionFileName(request.identity().region()), *bytes);
  }
  if (!status.ok()) return status;
  std::optional<records::Manifest> manifest =
      Call([&](Cluster& cluster, Now) { return cluster.NoteUploaded(request); });
  if (!manifest) return absl::OkStatus();
  return CompleteCheckpoint(id, *std::move(manifest));
}

absl::Status ControlPlane::CompleteCheckpoint(const std::string& id, records::Manifest manifest) {
  const auto scene = SceneBytes(manifest.scene_hash());
  if (!scene.ok()) return scene.status();
  if (absl::Status status = files_->Put(id, manifest.tick(), kSceneFile, *scene); !status.ok()) return status;
  AddFile(kSceneFile, *scene, manifest);
  if (HasGameFile(manifest)) {
    const auto game = GameBytes(manifest.game_hash());
    if (!game.ok()) return game.status();
    if (absl::Status status = files_->Put(id, manifest.tick(), kGameFile, *game); !status.ok()) return status;
    AddFile(kGameFile, *game, manifest);
  }
  const auto size = files_->Complete(id, manifest);
  if (!size.ok()) return size.status();
  spdlog::info("checkpoint made id={} tick={} bytes={}", id, manifest.tick(), *size);
  return Call([&](Cluster& cluster, Now now) {
    cluster.NoteCheckpoint(now, id, manifest, *size);
    return absl::OkStatus();
  });
}

absl::StatusOr<v1::Checkpoint> ControlPlane::CheckpointInstance(const v1::CheckpointInstanceRequest& request,
                                                                const std::function<bool()>& given_up) {
  if (!files_) return NoFiles();
  Lock lock(mutex_);
  Watch watch(*this, request.id());
  if (request.validate_only()) {
    const auto instance = GetInstance(cluster_->state(), request.id());
    return instance.ok() ? absl::StatusOr<v1::Checkpoint>(v1::Checkpoint()) : instance.status();
  }
  // None can be made while who runs what is being changed, and one under way ends with that: the next one comes after.
  // So it does where a region has missed the tick.
  for (const Clock::time_point patience = Clock::now() + kCheckpointTimeout;;) {
    const auto tick = cluster_->BeginCheckpoint(ReadClocks(), request.id());
    Publish();
    const auto made = tick.ok() ? AwaitCheckpoint(lock, watch, *tick, given_up) : tick.status();
    if (!absl::IsAborted(made.status()) || Clock::now() >= patience) return made;
    if (tick.ok()) continue;
    if (absl::Status status = WaitFor(lock, watch, patience, given_up); !status.ok()) return status;
  }
}

absl::StatusOr<v1::Checkpoint> ControlPlane::AwaitCheckpoint(Lock& lock, Watch& watch, std::uint64_t tick,
                                                             const std::function<bool()>& given_up) {
  while (true) {
    v1::ListCheckpointsRequest list;
    list.set_id(watch.id());
    const auto made = ListCheckpoints(cluster_->state(), list);
    if (!made.ok()) return made.status();
    for (const v1::Checkpoint& checkpoint : made->checkpoints()) {
      if (checkpoint.tick() == tick && !checkpoint.taken_back()) return checkpoint;
    }
    if (cluster_->CheckpointUnderWay(watch.id()) != tick) {
      const absl::Status why = cluster_->WhyNoCheckpoint(watch.id());
      return absl::Status(why.code(),
                          absl::StrCat("id: the checkpoint of ", watch.id(), " could not be made: ", why.message()));
    }
    if (absl::Status status = WaitFor(lock, watch, Clock::time_point::max(), given_up); !status.ok()) return status;
  }
}

// The newest checkpoint that is whole and not taken back, or the one that was asked for. `before`: it is older than
// this tick; 0: any is fine.
absl::StatusOr<records::Manifest> ControlPlane::FindWhole(const std::string& id, std::uint64_t tick,
                                                          std::vector<std::string>& damaged, std::uint64_t before) {
  if (!files_) return NoFiles();
  v1::ListCheckpointsRequest list;
  list.set_id(id);
  const auto listed = Call([&](Cluster& cluster, Now) { return ListCheckpoints(cluster.state(), list); });
  if (!listed.ok()) return listed.status();
  for (auto checkpoint = listed->checkpoints().rbegin(); checkpoint != listed->checkpoints().rend(); ++checkpoint) {
    if (tick == 0 ? checkpoint->taken_back() : checkpoint->tick() != tick) continue;
    if (before != 0 && checkpoint->tick() >= before) continue;
    const absl::Status whole = files_->Check(id, checkpoint->tick());
    if (whole.ok()) return files_->ReadManifest(id, checkpoint->tick());
    // One that cannot be read just now may be whole: an older one in its place would set the world back for nothing.
    const bool known = absl::IsNotFound(whole) || absl::IsDataLoss(whole);
    if (tick != 0 || !known) return whole;
    damaged.emplace_back(whole.message());
  }
  if (!damaged.empty()) return absl::DataLossError(absl::StrJoin(damaged, "; "));
  return absl::NotFoundError(tick == 0 ? absl::StrCat("id: ", id, " has no checkpoint")
                                       : absl::StrCat("tick: ", id, " has no checkpoint of tick ", tick));
}

absl::StatusOr<Contents> ControlPlane::KeptContents(const std::string& id, const records::Manifest& manifest) const {
  Contents contents;
  auto scene = files_->Read(id, manifest.tick(), kSceneFile);
  if (!scene.ok()) return scene.status();
  contents.scene = *std::move(scene);
  if (!HasGameFile(manifest)) return contents;
  auto game = files_->Read(id, manifest.tick(), kGameFile);
  if (!game.ok()) return game.status();
  contents.game = *std::move(game);
  return contents;
}

absl::StatusOr<v1::RestoreInstanceResponse> ControlPlane::RestoreInstance(const v1::RestoreInstanceRequest& request) {
  return RestoreBefore(request, 0);
}

absl::StatusOr<v1::RestoreInstanceResponse> ControlPlane::RestoreBefore(const v1::RestoreInstanceRequest& request,
                                                                        std::uint64_t before) {
  v1::RestoreInstanceResponse response;
  std::vector<std::string> damaged;
  const auto manifest = FindWhole(request.id(), request.tick(), damaged, before);
  if (!manifest.ok()) return manifest.status();
  const auto contents = KeptContents(request.id(), *manifest);
  if (!contents.ok()) return contents.status();
  for (const std::string& what : damaged) {
    spdlog::warn("checkpoint passed over: {}", what);
    response.add_damaged(what);
  }
  // The store has let the scene of a world that has FAILED go; that of one that runs is only held.
  std::unique_ptr<StagedScene> staged;
  if (!request.validate_only()) {
    auto stored = StageScene(manifest->scene_hash(), contents->scene);
    if (!stored.ok()) return stored.status();
    staged = *std::move(stored);
  }
  auto restored = Call([&](Cluster& cluster, Now now) {
    return cluster.Restore(now, request.id(), *manifest, *contents, request.validate_only());
  });
  if (!restored.ok()) return restored.status();
  *response.mutable_instance() = *std::move(restored);
  response.mutable_checkpoint()->set_tick(manifest->tick());
  response.mutable_checkpoint()->set_regions(static_cast<std::uint32_t>(manifest->map().regions_size()));
  return response;
}

absl::StatusOr<std::string> ControlPlane::StateFile(const v1::FetchStateRequest& request) {
  if (!files_) return NoFiles();
  const absl::Status status = Call([&](Cluster& cluster, Now) {
    absl::Status allowed = cluster.CheckFetch(request);
    if (!allowed.ok() || !importing_.contains(request.instance_id())) return allowed;
    return absl::UnavailableError("id: its files are being kept; ask again");
  });
  if (!status.ok()) return status;
  return files_->Read(request.instance_id(), request.tick(), RegionFileName(request.region()));
}

absl::StatusOr<std::string> ControlPlane::ExportCheckpoint(const v1::ExportCheckpointRequest& request) {
  std::vector<std::string> damaged;
  const auto manifest = FindWhole(request.id(), request.tick(), damaged);
  if (!manifest.ok()) return manifest.status();
  records::Bundle bundle;
  *bundle.mutable_manifest() = *manifest;
  for (const records::ManifestFile& file : manifest->files()) {
    auto bytes = files_->Read(request.id(), manifest->tick(), file.name());
    if (!bytes.ok()) return bytes.status();
    AddContent(bundle, file.name(), *std::move(bytes));
  }
  return Bundle(bundle);
}

absl::StatusOr<v1::Instance> ControlPlane::ImportCheckpoint(const v1::ImportCheckpointRequest& request,
                                                            const DraftFile& file, bool guests) {
  const auto bundle = BundleReader::Open(file);
  if (!bundle.ok()) return bundle.status();
  const records::Manifest& manifest = bundle->manifest();
  auto map = FromProto(manifest.map());
  if (!map.ok()) return absl::InvalidArgumentError(absl::StrCat("file: map: ", map.status().message()));
  v1::CreateInstanceRequest create;
  create.set_request_id(request.request_id());
  {
    const auto scene = bundle->Read(kSceneFile);
    if (!scene.ok()) return scene.status();
    if (!TakesAtMost(*scene, *v1::Scene::descriptor(), kMaxParsedBytes) ||
        !create.mutable_spec()->mutable_scene()->ParseFromString(*scene)) {
      return absl::InvalidArgumentError("file: has no scene that can be read");
    }
  }
  if (manifest.game_native()) {
    create.mutable_spec()->mutable_native_game()->set_name(manifest.game_name());
    create.mutable_spec()->mutable_native_game()->set_hash(manifest.game_hash());
  } else if (HasGameFile(manifest)) {
    auto game = bundle->Read(kGameFile);
    if (!game.ok()) return game.status();
    create.mutable_spec()->mutable_game()->set_name(manifest.game_name());
    create.mutable_spec()->mutable_game()->set_content(*std::move(game));
    if (manifest.has_movement()) *create.mutable_spec()->mutable_movement() = manifest.movement();
  }
  create.mutable_spec()->set_regions(static_cast<std::uint32_t>(map->regions().size()));
  create.mutable_spec()->set_snapshot_rate_hz(manifest.snapshot_rate_hz());
  *create.mutable_spec()->mutable_borders() = manifest.borders();
  create.mutable_spec()->set_region_threads(manifest.region_threads());
  auto plan = PlanInstance(create, guests);
  if (!plan.ok()) return plan.status();
  if (plan->scene_hash != manifest.scene_hash()) {  // a restore would keep this scene under the name of another
    return absl::InvalidArgumentError(absl::StrCat("file: scene_hash: is not that of its scene, ", plan->scene_hash));
  }
  plan->map = *std::move(map);
  plan->restored = manifest;
  plan->bodies = Within(plan->bodies, manifest.bodies());
  std::uint64_t size = 0;
  for (const records::ManifestFile& part : manifest.files()) size += part.size();
  std::unique_ptr<StagedScene> staged;  // ends after the lock
  if (!request.validate_only()) {
    auto stored = StageScene(plan->scene_hash, plan->contents.scene);
    if (!stored.ok()) return stored.status();
    staged = *std::move(stored);
  }
  Lock lock(mutex_);
  if (auto made = GetByRequestId(cluster_->state(), request.request_id()); made.ok()) return made;
  if (const absl::Status fits = cluster_->CheckCheckpointQuota(size); !fits.ok()) {
    return absl::Status(fits.code(), absl::StrCat("file: ", fits.message()));
  }
  auto instance = cluster_->CreateInstance(ReadClocks(), *plan, request.validate_only());
  Publish();
  if (!instance.ok() || request.validate_only()) return instance;
  const absl::Status kept = KeepImported(instance->id(), *bundle, lock);
  if (kept.ok()) return instance;
  v1::DeleteInstanceRequest undo;
  undo.set_id(instance->id());
  (void)cluster_->DeleteInstance(ReadClocks(), undo);  // gone already, perhaps
  Publish();
  return kept;
}

// Keeps the files of an instance that was just made, without the lock: whoever asks for one of them meanwhile is
// asked to come again. Requires the lock.
absl::Status ControlPlane::KeepImported(const std::string& id, const BundleReader& bundle, Lock& lock) {
  importing_.insert(id);
  lock.unlock();
  absl::Status status;
  for (const records::ManifestFile& file : bundle.manifest().files()) {
    if (!status.ok()) break;
    const auto bytes = bundle.Read(file.name());
    status = bytes.ok() ? files_->Put(id, bundle.manifest().tick(), file.name(), *bytes) : bytes.status();
  }
  std::uint64_t size = 0;
  if (status.ok()) {
    const auto completed = files_->Complete(id, bundle.manifest());
    if (completed.ok()) size = *completed;
    status = completed.status();
  }
  lock.lock();
  importing_.erase(id);
  if (status.ok()) cluster_->NoteCheckpoint(ReadClocks(), id, bundle.manifest(), size);
  Publish();
  return status;
}

// Runs on the files' thread, without the lock. The target is asked first, so that a world made meanwhile is known. The
// files stay: a store that is older than they are does not know all of its worlds.
void ControlPlane::LookForStrayCheckpoints() {
  auto strays = files_->Instances();
  if (!strays.ok()) {
    spdlog::warn("checkpoints of unknown worlds are not looked for error={}",
                 OneLine(std::string(strays.status().message()), kMaxReasonBytes));
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    const std::vector<std::string>& removed = pending_.forgotten;  // since this began; their files go next
    std::erase_if(*strays, [&](const std::string& id) {
      return NumberOf(id, kInstanceId) == 0 || cluster_->state().FindInstance(id) != nullptr ||
             cluster_->state().IsSetAside(InstanceKey(NumberOf(id, kInstanceId))) ||
             std::find(removed.begin(), removed.end(), id) != removed.end();
    });
  }
  stray_checkpoints_ = strays->size();
  if (strays->empty()) return;
  const std::size_t worlds = strays->size();
  strays->resize(std::min(worlds, kNamedStrays));
  spdlog::warn(
      "checkpoints of worlds that the store does not know worlds={}: {}{}; they stay until somebody removes them",
      worlds, absl::StrJoin(*strays, ", "), worlds > kNamedStrays ? " and more" : "");
}

// Runs on the files' thread, without the lock.
void ControlPlane::DoPendingWork(PendingWork work) {
  for (const std::string& sha256 : work.visuals) RemoveVisual(sha256);
  RemoveScenePieces(work.scene_pieces);
  if (!files_) {
    work = PendingWork{
        .pruned = {}, .abandoned = {}, .forgotten = {}, .restore = work.restore, .visuals = {}, .scene_pieces = {}};
  }
  for (const auto& [id, tick] : work.pruned) files_->Remove(id, tick);
  for (const auto& [id, tick] : work.abandoned) files_->Abandon(id, tick);
  for (const std::string& id : work.forgotten) files_->RemoveAll(id);
  for (const std::string& id : work.restore) {
    // It may have ended for good since, or an operator has restored it.
    const auto before = Call([&](Cluster& cluster, Now) { return cluster.RestoreWantedBefore(id); });
    if (!before) continue;
    v1::RestoreInstanceRequest request;
    request.set_id(id);
    const auto restored = RestoreBefore(request, *before);
    if (restored.ok()) continue;
    Call([&](Cluster& cluster, Now now) {
      const std::string why(restored.status().message());
      if (MayPass(restored.status())) {
        cluster.NoteRestoreWaits(id, why);
      } else {
        cluster.CannotRestore(now, id, why);
      }
      return 0;
    });
  }
}

}  // namespace tessera::control
