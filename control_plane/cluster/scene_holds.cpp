// ClusterState's part in scenes and games: what the store lacks, and who holds a large scene while an instance is made
// with it.
#include <string>
#include <vector>

#include "control_plane/cluster/cluster_state.h"
#include "control_plane/stored_records.h"

namespace tessera::control {

std::vector<StoreOp> ClusterState::PutMissing(const records::Instance& record, const Contents& contents) const {
  std::vector<StoreOp> ops;
  for (const std::string& key : ContentKeys(record)) {
    const auto use = contents_.find(key);
    if (use != contents_.end() && use->second.revision != kAbsent) continue;
    const std::string& bytes = IsSceneKey(key) ? contents.scene : contents.game;
    if (use != contents_.end() && bytes.empty()) continue;  // the store has lost it, and nobody brings it
    ops.push_back(PutOp(key, bytes, kAbsent));
  }
  return ops;
}

absl::Status ClusterState::ReuseContents(const records::Instance& record, const Contents& contents) {
  if (const std::vector<StoreOp> missing = PutMissing(record, contents); !missing.empty()) {
    const auto written = Write(missing);
    if (!written.ok()) return absl::UnavailableError(written.status().message());
    for (const StoreOp& put : missing) contents_[put.key].revision = *written;
  }
  for (const std::string& key : ContentKeys(record)) ++contents_[key].instances;
  return absl::OkStatus();
}

bool ClusterState::HoldScene(const std::string& hash) {
  const auto use = contents_.find(SceneKey(hash));
  if (use == contents_.end() || use->second.revision == kAbsent) return false;
  ++use->second.instances;
  return true;
}

absl::Status ClusterState::AdoptScene(const std::string& hash, const ScenePieces& pieces) {
  if (HoldScene(hash)) {
    const std::vector<std::string> keys = ScenePieceKeys(hash, pieces);
    effects_.scene_pieces.insert(effects_.scene_pieces.end(), keys.begin(), keys.end());
    return absl::OkStatus();
  }
  const std::string key = SceneKey(hash);
  const auto written = WriteStored(std::vector<StoreOp>{PutOp(key, SceneRecord(pieces), kAbsent)});
  if (!written.ok()) return written.status();
  ContentUse& use = contents_[key];  // instances may need it already, of which it was lost
  ++use.instances;
  use.revision = *written;
  use.pieces = pieces;
  return absl::OkStatus();
}

void ClusterState::ReleaseScene(const std::string& hash) {
  const auto use = contents_.find(SceneKey(hash));
  if (use == contents_.end() || --use->second.instances > 0) return;
  if (!set_aside_.empty()) return;  // one that is set aside may use it
  if (use->second.revision == kAbsent) return ForgetContent(use);
  // Where it cannot be removed now, the next life does it.
  if (Write(std::vector<StoreOp>{DeleteOp(use->first, use->second.revision)}).ok()) ForgetContent(use);
}

void ClusterState::ForgetContent(std::map<std::string, ContentUse>::iterator use) {
  if (use->second.pieces) {
    // The key without "scene/".
    const std::vector<std::string> keys = ScenePieceKeys(use->first.substr(SceneKey("").size()), *use->second.pieces);
    effects_.scene_pieces.insert(effects_.scene_pieces.end(), keys.begin(), keys.end());
  }
  contents_.erase(use);
}

// A scene in pieces of an instance that was never made, because its maker ended before.
absl::Status ClusterState::DropStray(const std::string& key, const StoredContent& content) {
  const auto written = Write(std::vector<StoreOp>{DeleteOp(key, content.revision)});
  if (!written.ok()) return absl::UnavailableError(written.status().message());
  const auto use = contents_.emplace(key, ContentUse{.revision = kAbsent, .pieces = content.pieces}).first;
  ForgetContent(use);
  return absl::OkStatus();
}

}  // namespace tessera::control
