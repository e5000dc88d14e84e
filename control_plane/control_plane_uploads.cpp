// ControlPlane's part in large scenes: they come before the requests that make worlds of them.
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/control_plane.h"
#include "control_plane/instance_plan.h"
#include "control_plane/one_line.h"
#include "core/world/sha256.h"

namespace tessera::control {

absl::StatusOr<WaitingScenes::Place> ControlPlane::BeginScene(const std::string& hash, std::uint64_t size) {
  return waiting_scenes_.Begin(hash, size, ReadClocks().steady);
}

absl::Status ControlPlane::KeepScene(const WaitingScenes::Place& place, DraftFile draft) {
  return waiting_scenes_.Keep(place, std::move(draft), ReadClocks().steady);
}

// One at a time: a large scene takes several times its size while it is checked.
absl::StatusOr<InstancePlan> ControlPlane::PlanOfUploaded(const v1::CreateInstanceRequest& request, bool guests) {
  const std::string& hash = request.spec().scene_file();
  if (request.spec().has_scene()) return absl::InvalidArgumentError("spec.scene_file: spec.scene is there too");
  const std::lock_guard one(uploads_mutex_);
  auto bytes = waiting_scenes_.Bytes(hash, ReadClocks().steady);
  if (absl::IsNotFound(bytes.status())) bytes = SceneBytes(hash);
  if (absl::IsNotFound(bytes.status())) {
    return absl::FailedPreconditionError(absl::StrCat("spec.scene_file: no scene ", OneLine(hash, kSha256Digits),
                                                      " is here; it is to be sent first (PutScene)"));
  }
  if (!bytes.ok())
    return absl::Status(bytes.status().code(), absl::StrCat("spec.scene_file: ", bytes.status().message()));
  return PlanInstance(request, guests, &*bytes);
}

}  // namespace tessera::control
