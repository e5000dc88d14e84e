// ControlPlane's part in large scenes: their pieces, which are written and removed without the cluster's lock.
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "control_plane/control_plane.h"
#include "control_plane/secrets.h"
#include "control_plane/stored_records.h"

namespace tessera::control {
namespace {

constexpr std::size_t kSceneVersionBytes = 16;

}  // namespace

ControlPlane::StagedScene::~StagedScene() {
  plane_.Call([&](Cluster& cluster, Now) {
    cluster.ReleaseScene(hash_);
    return 0;
  });
}

absl::StatusOr<std::unique_ptr<ControlPlane::StagedScene>> ControlPlane::StageScene(const std::string& hash,
                                                                                    const std::string& bytes) {
  if (bytes.size() <= kWholeSceneBytes) return nullptr;
  // One after the other: the second of two that bring the same scene finds it there.
  const std::lock_guard writing(scene_mutex_);
  if (Call([&](Cluster& cluster, Now) { return cluster.HoldScene(hash); })) {
    return std::make_unique<StagedScene>(*this, hash);
  }
  const ScenePieces pieces{.version = absl::BytesToHexString(SystemRandomBytes(kSceneVersionBytes)),
                           .bytes = bytes.size()};
  const std::vector<std::string> keys = ScenePieceKeys(hash, pieces);
  absl::Status status = WriteScenePieces(keys, bytes);
  if (status.ok()) status = Call([&](Cluster& cluster, Now) { return cluster.AdoptScene(hash, pieces); });
  if (status.ok()) return std::make_unique<StagedScene>(*this, hash);
  RemoveScenePieces(keys);
  return status;
}

absl::Status ControlPlane::WriteScenePieces(const std::vector<std::string>& keys, const std::string& bytes) {
  for (std::size_t number = 0; number < keys.size(); ++number) {
    const auto piece = std::string_view(bytes).substr(number * kScenePieceBytes, kScenePieceBytes);
    if (const auto written = store_.Put(keys[number], piece, kAbsent); !written.ok()) {
      return absl::UnavailableError(written.status().message());
    }
    Lock lock(mutex_);
    if (stop_.wait_for(lock, kVisualPause, [this] { return stopping_; })) {
      return absl::UnavailableError("the control plane is ending");
    }
  }
  return absl::OkStatus();
}

// Those that cannot be removed are found by the next life.
void ControlPlane::RemoveScenePieces(const std::vector<std::string>& keys) {
  for (const std::string& key : keys) {
    // By a list, which has damaged ones too.
    const auto found = store_.List(key);
    const bool there = found.ok() && !found->empty() && found->front().key == key;
    if (there) (void)store_.Delete(key, found->front().revision);
  }
}

}  // namespace tessera::control
