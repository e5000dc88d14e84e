#include "local_cluster/scene_file.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

#include "host/files.h"
#include "host/program_folder.h"
#include "local_cluster/command_error.h"

namespace tessera::local {
LoadedScene LoadScene(const std::string& path, std::optional<std::uint32_t> bodies) {
  const auto text = host::ReadFile(path, kMaxSceneBytes);
  if (!text.ok()) throw CommandError(fmt::format("scene {}", std::string(text.status().message())));
  const SceneForm form = path.ends_with(kSerialisedEnding) ? SceneForm::kSerialised : SceneForm::kText;
  return OrThrow(tessera::LoadScene(form, *text, path, {.scatter_count = bodies, .hash = {}}));
}

std::string FindScene(const std::string& name) {
  namespace fs = std::filesystem;
  std::vector<fs::path> places;
  if (const char* folder = std::getenv("TESSERA_SCENES")) places.emplace_back(folder);
  std::error_code error;
  const fs::path here = host::ProgramFolder();
  places.push_back(here.parent_path() / "share/tessera/scenes");
  for (fs::path up = here; up.has_relative_path(); up = up.parent_path()) places.push_back(up / "scenes");
  for (const fs::path& place : places) {
    for (const fs::path& file : {place / (name + ".textproto"), place.parent_path() / "games" / name / "scene.json"}) {
      if (fs::exists(file, error)) return file.string();
    }
  }
  throw CommandError(fmt::format(
      "scene {}: no {}.textproto beside this program; set TESSERA_SCENES to the folder of scenes", name, name));
}

std::string GameBeside(const std::string& scene_path) {
  const std::filesystem::path scene(scene_path), game = scene.parent_path() / "game.lua";
  std::error_code error;
  return scene.filename() == "scene.json" && std::filesystem::exists(game, error) ? game.string() : "";
}

}  // namespace tessera::local
