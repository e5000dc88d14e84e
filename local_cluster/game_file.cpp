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
  const game::GameFile file{std::filesystem::path(path).filename().string(), *std::move(content)};
  const absl::Status fit = game::CheckGameFile(file);  // else it could not even be sent
  if (!fit.ok()) throw CommandError(fmt::format("game {}: {}", path, std::string(fit.message())));
  v1::GameSource source;
  source.set_name(file.name);
  source.set_content(file.bytes);
  return source;
}

}  // namespace tessera::local
