#include "local_cluster/scene_file.h"

#include <fmt/format.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/world/scene_io.h"
#include "local_cluster/command_error.h"

namespace tessera::local {

LoadedScene LoadScene(const std::string& path, std::optional<std::uint32_t> bodies) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  if (!file || std::filesystem::is_directory(path) || !(text << file.rdbuf())) {
    throw CommandError(fmt::format("scene {}: cannot be read: {}", path, std::strerror(errno != 0 ? errno : EISDIR)));
  }
  LoadedScene loaded;
  auto message = ParseScene(text.str(), path);
  if (!message.ok()) throw CommandError(std::string(message.status().message()));
  loaded.message = *std::move(message);
  if (bodies) OverrideScatterCount(loaded.message, *bodies);
  auto scene = ResolveScene(loaded.message, path);
  if (!scene.ok()) throw CommandError(std::string(scene.status().message()));
  loaded.scene = *std::move(scene);
  return loaded;
}

std::string FindScene(const std::string& name) {
  namespace fs = std::filesystem;
  std::vector<fs::path> places;
  if (const char* folder = std::getenv("TESSERA_SCENES")) places.emplace_back(folder);
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  places.push_back(self.parent_path().parent_path() / "share/tessera/scenes");
  for (fs::path up = self.parent_path(); up.has_relative_path(); up = up.parent_path()) places.push_back(up / "scenes");
  for (const fs::path& place : places) {
    const fs::path file = place / (name + ".textproto");
    if (fs::exists(file, error)) return file.string();
  }
  throw CommandError(fmt::format(
      "scene {}: no {}.textproto beside this program; set TESSERA_SCENES to the folder of scenes", name, name));
}

}  // namespace tessera::local
