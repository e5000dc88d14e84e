#include "core/world/scene_load.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/scene_io.h"

namespace tessera {
namespace {

absl::StatusOr<v1::Scene> ReadMessage(SceneForm form, std::string_view content, std::string_view name) {
  if (form == SceneForm::kText) return ParseScene(content, name);
  v1::Scene message;
  if (message.ParseFromArray(content.data(), static_cast<int>(content.size()))) return message;
  return absl::InvalidArgumentError(absl::StrCat(std::string(name), ": not a serialised scene"));
}

void SetScatterCount(v1::Scene& scene, std::uint32_t count) {
  if (scene.scatters().empty()) return;
  if (count == 0) {
    scene.mutable_scatters()->DeleteSubrange(0, 1);
  } else {
    scene.mutable_scatters(0)->set_count(count);
  }
}

}  // namespace

SceneForm SceneFormOf(std::string_view path) {
  for (const char* suffix : {".textproto", ".txtpb", ".json"}) {
    if (path.ends_with(suffix)) return SceneForm::kText;
  }
  return SceneForm::kSerialised;
}

absl::StatusOr<LoadedScene> LoadScene(SceneForm form, std::string_view content, std::string_view name,
                                      const SceneDemands& demands) {
  absl::StatusOr<v1::Scene> message = ReadMessage(form, content, name);
  if (!message.ok()) return message.status();
  return LoadScene(*std::move(message), name, demands);
}

absl::StatusOr<LoadedScene> LoadScene(v1::Scene message, std::string_view name, const SceneDemands& demands) {
  LoadedScene loaded{.message = std::move(message), .hash = {}, .scene = nullptr};
  if (demands.scatter_count) SetScatterCount(loaded.message, *demands.scatter_count);
  loaded.hash = SceneHash(loaded.message);
  if (!demands.hash.empty() && loaded.hash != demands.hash) {
    return absl::InvalidArgumentError(
        absl::StrCat(std::string(name), ": its hash is ", loaded.hash, ", not ", demands.hash));
  }
  absl::StatusOr<std::shared_ptr<const Scene>> scene = ResolveScene(loaded.message, name);
  if (!scene.ok()) return scene.status();
  loaded.scene = *std::move(scene);
  return loaded;
}

}  // namespace tessera
