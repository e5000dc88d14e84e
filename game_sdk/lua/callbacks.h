// Callbacks: which functions of a loaded game the host may call.
//
// Thread rule: as lua_State.
#pragma once

#include <string>
#include <vector>

#include "game_sdk/api/api.h"
#include "lua.hpp"

namespace tessera::game {

class LoadedCallbacks {
 public:
  // Takes the callbacks from the table of globals on top of the stack, or raises an error that names what is none.
  // Pushes a list of their functions. Only while the game is loaded.
  void Collect(lua_State* L);

  // Reference of the function in the registry; 0 if there is none. `kind` is nullptr for callbacks of the world.
  int Find(std::uint32_t callback, const char* kind) const;
  // The same, quicker where it is the one that was found last.
  int FindAgain(std::uint32_t callback, const char* kind);

 private:
  struct Found {
    std::uint32_t callback = 0;
    const std::string* kind = nullptr;  // one of kinds_
    int reference = 0;
  };
  struct Kind {
    std::string name;
    std::vector<int> references;  // by position in the table of callbacks
  };
  const Kind* KindOf(const char* kind) const;
  bool AddKind(const char* name) noexcept;
  // Takes the function on top as a callback of the newest kind, and appends it to the list at `list`.
  void Add(lua_State* L, const Callback& callback, int list);
  void CollectWorld(lua_State* L, int globals, int list);
  void CollectKind(lua_State* L, int entry, int list);

  std::vector<Kind> kinds_;  // the first, without a name, is the world; the others ascend
  Found found_;              // once all kinds are there
};

}  // namespace tessera::game
