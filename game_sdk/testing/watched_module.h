// WatchedModule: a game module around another one, through which a test takes part in a game: it acts at the beginning
// of each tick as if it were the game, and has the game's code loaded anew before a callback.
//
//   WatchScope scope(*LuaGameModule(), watcher);                       // for the games that are loaded meanwhile
//   auto host = GameHost::Load(WatchedModule(), {"game.lua", text}, scene);
//
// Thread rule: one thread at a time; different threads may have scopes of their own.
#pragma once

#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

class Watcher {
 public:
  virtual ~Watcher() = default;
  // It is called first in each tick of each region, in the same transaction as the game's on_tick.
  virtual void AtTick(const tessera_game_host& host, tessera_game_call* call) = 0;
  // Whether the next callback is to run in a fresh state.
  virtual bool WantsFreshState() = 0;
};

// Games that are loaded, by GameHost::Load or Renew, while it lives are of `inner`, and belong to the watcher, which
// has to outlive them. One at a time in a thread.
class WatchScope {
 public:
  WatchScope(const tessera_game_module& inner, Watcher& watcher);
  ~WatchScope();
  WatchScope(const WatchScope&) = delete;
  WatchScope& operator=(const WatchScope&) = delete;
};

const tessera_game_module& WatchedModule();

}  // namespace tessera::game
