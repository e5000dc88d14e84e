#include "local_cluster/game_file.h"

#include <fmt/format.h>

#include <filesystem>

#include "core/game/game_file.h"
#include "host/files.h"
#include "local_cluster/command_error.h"

namespace tessera::local {

v1::GameSource LoadGame(const std::string& path) {
  auto content = host::ReadFile(path, game::kMaxGameFileBytes);
  if (!content.ok()) throw CommandError(fmt::format("game {}", std::string(content.status().message())));
  v1::GameSource source;
  source.set_name(std::filesystem::path(path).filename().string());
  source.set_content(*std::move(content));
  return source;
}

}  // namespace tessera::local
