#include "local_cluster/game_file.h"

#include <fmt/format.h>

#include <filesystem>

#include "core/game/game_file.h"
#include "core/game/native_name.h"
#include "host/files.h"
#include "local_cluster/command_error.h"

namespace tessera::local {

v1::GameSource LoadGame(const std::string& path) {
  if (game::IsNativeGame(path)) {
    throw CommandError(
        fmt::format("game {}: only a Lua file can be given here; a world's native game is chosen when "
                    "it is made, and stays",
                    path));
  }
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

void SetGame(const std::string& game, v1::InstanceSpec& spec) {
  if (!game::IsNativeGame(game)) {
    *spec.mutable_game() = LoadGame(game);
    return;
  }
  const auto native = game::ParseNativeGame(game);
  if (!native.ok()) throw CommandError(fmt::format("--game {}: {}", game, std::string(native.status().message())));
  spec.mutable_native_game()->set_name(native->name);
  spec.mutable_native_game()->set_hash(native->hash);
}

void SetMovement(const std::string& movement, v1::InstanceSpec& spec) {
  if (!game::IsNativeGame(movement)) {
    throw CommandError(fmt::format("--movement {}: must be native:NAME, a shared library that hosts have", movement));
  }
  const auto native = game::ParseNativeGame(movement);
  if (!native.ok()) {
    throw CommandError(fmt::format("--movement {}: {}", movement, std::string(native.status().message())));
  }
  spec.mutable_movement()->set_name(native->name);
  spec.mutable_movement()->set_hash(native->hash);
}

}  // namespace tessera::local
