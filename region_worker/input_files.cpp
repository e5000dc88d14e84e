#include "region_worker/input_files.h"

#include "core/game/game_file.h"
#include "core/world/scene_load.h"
#include "host/files.h"

namespace tessera::worker {
namespace {

constexpr std::size_t kMaxStateBytes = std::size_t{1} << 30;  // the state of a region with a million bodies

}  // namespace

absl::StatusOr<std::shared_ptr<const Scene>> LoadSceneFile(const std::string& path, const std::string& hash) {
  const absl::StatusOr<std::string> content = host::ReadFile(path, kMaxSceneBytes);
  if (!content.ok()) return content.status();
  absl::StatusOr<LoadedScene> loaded =
      LoadScene(SceneFormOf(path), *content, path, {.scatter_count = {}, .hash = hash});
  if (!loaded.ok()) return loaded.status();
  return std::move(loaded->scene);
}

absl::StatusOr<std::string> ReadGameFile(const std::string& path) {
  return host::ReadFile(path, game::kMaxGameFileBytes);
}

absl::StatusOr<region::Bytes> ReadStateFile(const std::string& path) {
  const absl::StatusOr<std::string> content = host::ReadFile(path, kMaxStateBytes);
  if (!content.ok()) return content.status();
  return region::Bytes(content->begin(), content->end());
}

}  // namespace tessera::worker
