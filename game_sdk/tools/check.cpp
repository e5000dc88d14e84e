#include "game_sdk/tools/check.h"

#include <algorithm>
#include <charconv>

#include "absl/strings/str_cat.h"
#include "core/game/calls.h"
#include "game_sdk/lua/limits.h"
#include "game_sdk/lua/lua_module.h"
#include "game_sdk/tools/lua_tree.h"
#include "game_sdk/tools/source_check.h"
#include "lua.hpp"

namespace tessera::game {
namespace {

// "game.lua:3: text" as a fault.
GameFault FaultOf(const GameFile& game, std::string_view error) {
  GameFault fault;
  std::string_view rest = error;
  if (rest.starts_with(game.name) && rest.substr(game.name.size()).starts_with(":")) {
    rest.remove_prefix(game.name.size() + 1);
    const auto [end, status] = std::from_chars(rest.data(), rest.data() + rest.size(), fault.line);
    if (status == std::errc()) rest.remove_prefix(static_cast<std::size_t>(end - rest.data()) + 1);
    while (rest.starts_with(' ')) rest.remove_prefix(1);
  }
  fault.text = rest;
  return fault;
}

bool Compiles(const GameFile& game) {
  lua_State* const L = luaL_newstate();
  if (L == nullptr) return false;
  const bool compiles = luaL_loadbufferx(L, game.bytes.data(), game.bytes.size(), "=", "t") == LUA_OK;
  lua_close(L);
  return compiles;
}

}  // namespace

std::vector<GameFault> CheckGame(const GameFile& game, const Scene& scene) {
  std::vector<GameFault> faults;
  const tessera_game_source source{sizeof source, game.name.c_str(), game.bytes.data(), game.bytes.size()};
  tessera_game_error error{};
  void* loaded = nullptr;
  const tessera_game_module& module = *LuaGameModule();
  if (module.load(&GameFunctions(), &source, &loaded, &error) != 0) {
    faults.push_back(FaultOf(game, error.text));
    if (game.bytes.size() > kMaxSourceBytes || !Compiles(game)) return faults;
  } else {
    module.unload(loaded);
  }
  const absl::StatusOr<std::unique_ptr<LuaNode>> tree = ParseLua(game.bytes);
  if (!tree.ok()) {
    faults.push_back({0, std::string(tree.status().message())});
    return faults;
  }
  std::vector<GameFault> found = CheckSource(**tree, scene);
  // The loader stops at its first fault, which the source may show as well.
  std::erase_if(faults, [&](const GameFault& fault) {
    return fault.line != 0 && std::ranges::find(found, fault.line, &GameFault::line) != found.end();
  });
  faults.insert(faults.end(), found.begin(), found.end());
  std::ranges::sort(faults);
  faults.erase(std::unique(faults.begin(), faults.end()), faults.end());
  if (faults.size() > kMaxFaults) faults.resize(kMaxFaults);
  return faults;
}

}  // namespace tessera::game
