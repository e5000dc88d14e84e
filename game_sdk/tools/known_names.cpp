#include "game_sdk/tools/known_names.h"

#include <vector>

#include "game_sdk/api/api.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/sandbox.h"

namespace tessera::game {
namespace {

constexpr tessera_game_host kNoHost = {sizeof kNoHost, nullptr, nullptr, nullptr};

}  // namespace

KnownNames NamesOfSandbox() {
  KnownNames known;
  Runtime runtime(&kNoHost, "");
  lua_State* const L = runtime.lua();
  if (L == nullptr) return known;
  runtime.BeginCall(nullptr);
  lua_pushcfunction(L, SetUpState);
  if (lua_pcall(L, 0, 0, 0) != LUA_OK) return known;
  lua_pushglobaltable(L);
  const int globals = lua_gettop(L);
  for (lua_pushnil(L); lua_next(L, globals) != 0; lua_pop(L, 1)) {
    const std::string name = lua_tostring(L, -2);
    known.globals.insert(name);
    if (!lua_istable(L, -1) || name == "kinds") continue;
    const int library = lua_gettop(L);
    for (lua_pushnil(L); lua_next(L, library) != 0; lua_pop(L, 1)) {
      if (lua_type(L, -2) == LUA_TSTRING) known.libraries[name].insert(lua_tostring(L, -2));
    }
  }
  return known;
}

}  // namespace tessera::game
