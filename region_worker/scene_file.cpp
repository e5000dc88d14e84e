#include "region_worker/scene_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/world/scene_io.h"

namespace tessera::worker {
namespace {

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  if (std::error_code error; std::filesystem::is_directory(path, error)) {
    return absl::NotFoundError(absl::StrCat(path, ": is a directory"));
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  if (file) content << file.rdbuf();
  if (!file) return absl::NotFoundError(absl::StrCat(path, ": ", std::strerror(errno == 0 ? EIO : errno)));
  return std::move(content).str();
}

absl::StatusOr<v1::Scene> Read(const std::string& content, const std::string& path) {
  for (const char* suffix : {".textproto", ".txtpb", ".json"}) {
    if (absl::EndsWith(path, suffix)) return ParseScene(content, path);
  }
  v1::Scene scene;
  if (!scene.ParseFromString(content))
    return absl::InvalidArgumentError(absl::StrCat(path, ": not a serialised scene"));
  return scene;
}

}  // namespace

absl::StatusOr<std::shared_ptr<const Scene>> LoadSceneFile(const std::string& path, const std::string& hash) {
  const absl::StatusOr<std::string> content = ReadFile(path);
  if (!content.ok()) return content.status();
  const absl::StatusOr<v1::Scene> message = Read(*content, path);
  if (!message.ok()) return message.status();
  if (!hash.empty()) {
    if (const std::string found = SceneHash(*message); found != hash) {
      return absl::InvalidArgumentError(absl::StrCat(path, ": its hash is ", found, ", the order's is ", hash));
    }
  }
  return ResolveScene(*message, path);
}

}  // namespace tessera::worker
