#include "agent/content.h"

#include "absl/strings/str_cat.h"
#include "agent/limits.h"
#include "core/game/game_file.h"
#include "core/world/scene_io.h"
#include "tessera/v1/scene.pb.h"

namespace tessera::agent {

const char* NameOf(ContentKind kind) { return kind == ContentKind::kScene ? "scene" : "game"; }

std::size_t MaxContentBytes(ContentKind kind) {
  return kind == ContentKind::kScene ? std::size_t{kMaxMessageBytes} : game::kMaxGameFileBytes;
}

absl::Status CheckContent(const Content& content, const std::string& bytes) {
  const std::size_t most = MaxContentBytes(content.kind);
  if (bytes.size() > most) {
    return absl::InvalidArgumentError(absl::StrCat("has ", bytes.size(), " bytes, more than ", most));
  }
  std::string hash;
  if (content.kind == ContentKind::kScene) {
    v1::Scene scene;
    if (!scene.ParseFromString(bytes)) return absl::InvalidArgumentError("is no scene");
    hash = SceneHash(scene);
  } else {
    hash = game::GameHash(bytes);
  }
  if (hash != content.hash) return absl::InvalidArgumentError(absl::StrCat("has hash ", hash));
  return absl::OkStatus();
}

std::vector<Content> ContentsOf(const v1::WorkerOrder& order) {
  std::vector<Content> contents{{ContentKind::kScene, order.scene_hash()}};
  if (!order.game_hash().empty() && !order.game_native()) {
    contents.push_back({ContentKind::kGame, order.game_hash()});
  }
  if (order.has_next_game()) contents.push_back({ContentKind::kGame, order.next_game().hash()});
  return contents;
}

}  // namespace tessera::agent
