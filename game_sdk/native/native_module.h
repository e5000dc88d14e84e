// NativeModule: a shared library, out of a folder of the operator's, that is a game, or has a movement for a game in
// Lua. It is trusted: it runs in the worker's process, with all that the worker may do.
//
//   auto module = NativeModule::Load("/usr/lib/tessera/games", "arena", hash);       // arena.so
//   if (!module.ok()) return module.status();
//   GameHost::Load((*module)->module(), {"arena", ""}, scene);   // with the movement that it has
//
//   auto car = NativeModule::LoadMovement("/usr/lib/tessera/games", "car");
//   GameHost::Load(*LuaGameModule(), {"game.lua", text, (*car)->movement()}, scene);
//
// A library that is loaded stays until the process ends. Where one crashes, the process dies as it would without a
// game, after a line on stderr that names the game and the callback that ran (kDiedInModule).
//
// Thread rule: one thread loads, and runs, the games of a process.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/game/native_name.h"
#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

// Bytes of a library. All of it is read once, for its hash.
inline constexpr std::size_t kMaxModuleBytes = std::size_t{256} << 20;

class NativeModule {
 public:
  using Loaded = absl::StatusOr<std::shared_ptr<const NativeModule>>;
  // Loads `folder`/`name`.so, which is a game. `hash`: SHA-256 of the library in hexadecimal digits, if it must be that
  // build; empty: any. Errors, each with the name: INVALID_ARGUMENT: no name; NOT_FOUND: no such file;
  // FAILED_PRECONDITION: another build, no library of this machine, one without tessera_game_module_1, one of another
  // version of the interface.
  static Loaded Load(const std::string& folder, std::string_view name, std::string_view hash = {});
  // The same for one with a movement: alone (tessera_movement_1), or a game's own.
  static Loaded LoadMovement(const std::string& folder, std::string_view name, std::string_view hash = {});
  // The same for either.
  static Loaded LoadAny(const std::string& folder, std::string_view name, std::string_view hash = {});
  // Loads the file at `path` for its movement. INVALID_ARGUMENT, too: it does not end in ".so".
  static Loaded LoadMovementFile(const std::string& path);

  // These are valid as long as the process lives. The functions of the game; its movement alone where it is none.
  const tessera_game_module& module() const { return watched_; }
  bool is_game() const { return watched_.load != nullptr; }
  const tessera_movement* movement() const { return watched_.movement; }  // null without one
  const std::string& name() const { return name_; }
  const std::string& hash() const { return hash_; }

 private:
  NativeModule(std::string name, std::string hash, bool is_game, const tessera_movement* movement);
  static int MoveNative(const tessera_movement_tick* tick, void* state, tessera_movement_push* push);

  const std::string name_, hash_;
  // These note what runs, and pass it on to the library's.
  const tessera_movement* const movement_;  // the library's; null without one
  tessera_movement watched_movement_{};
  const tessera_game_module watched_;
};

}  // namespace tessera::game
