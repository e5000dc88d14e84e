#include "game_sdk/testing/watched_module.h"

#include <cassert>
#include <memory>
#include <string>

#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

// The interface has no pointer of ours in `load`.
thread_local const tessera_game_module* scope_module = nullptr;
thread_local Watcher* scope_watcher = nullptr;

struct WatchedGame {
  const tessera_game_module* module;
  Watcher* watcher;
  const tessera_game_host* host;
  std::string name, bytes;
  void* game = nullptr;

  int Load(tessera_game_error* error) {
    const tessera_game_source source{sizeof source, name.c_str(), bytes.data(), bytes.size()};
    void* loaded = nullptr;
    if (const int status = module->load(host, &source, &loaded, error); status != 0) return status;
    Unload();
    game = loaded;
    return 0;
  }
  void Unload() {
    if (game != nullptr) module->unload(game);
    game = nullptr;
  }
};

int LoadWatched(const tessera_game_host* host, const tessera_game_source* source, void** game,
                tessera_game_error* error) {
  assert(scope_watcher != nullptr);
  auto watched = std::make_unique<WatchedGame>(
      WatchedGame{scope_module, scope_watcher, host, source->name, std::string(source->bytes, source->byte_count)});
  if (const int status = watched->Load(error); status != 0) return status;
  *game = watched.release();
  return 0;
}

void UnloadWatched(void* game) {
  const std::unique_ptr<WatchedGame> watched(static_cast<WatchedGame*>(game));
  watched->Unload();
}

int HandlesWatched(const void* game, std::uint32_t callback, const char* kind) {
  const auto& watched = *static_cast<const WatchedGame*>(game);
  if (callback == kOnTick) return 1;
  return watched.module->handles(watched.game, callback, kind);
}

int RunWatched(void* game, tessera_game_call* call, const tessera_game_callback* event, tessera_game_error* error) {
  auto& watched = *static_cast<WatchedGame*>(game);
  if (event->callback == kOnTick) {
    watched.watcher->AtTick(*watched.host, call);
    if (watched.module->handles(watched.game, kOnTick, nullptr) == 0) return 0;
  }
  if (watched.watcher->WantsFreshState()) {
    if (const int status = watched.Load(error); status != 0) return status;
  }
  return watched.module->run(watched.game, call, event, error);
}

constexpr tessera_game_module kWatchedModule = {sizeof kWatchedModule, TESSERA_GAME_ABI, LoadWatched, UnloadWatched,
                                                HandlesWatched,        RunWatched,       nullptr};

}  // namespace

WatchScope::WatchScope(const tessera_game_module& inner, Watcher& watcher) {
  assert(scope_watcher == nullptr);
  scope_module = &inner;
  scope_watcher = &watcher;
}

WatchScope::~WatchScope() {
  scope_module = nullptr;
  scope_watcher = nullptr;
}

const tessera_game_module& WatchedModule() { return kWatchedModule; }

}  // namespace tessera::game
