#include "game_sdk/lua/lua_module.h"

#include <cstdio>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "game_sdk/lua/bindings.h"
#include "game_sdk/lua/callbacks.h"
#include "game_sdk/lua/error_text.h"
#include "game_sdk/lua/freeze.h"
#include "game_sdk/lua/handles.h"
#include "game_sdk/lua/kept_state.h"
#include "game_sdk/lua/limits.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/reach.h"
#include "game_sdk/lua/sandbox.h"
#include "game_sdk/lua/values.h"

namespace tessera::game {
namespace {

// The message handler stays at the bottom of the stack.
constexpr int kHandler = 1;

struct Game {
  Game(const tessera_game_host* host, const char* name) : runtime(host, name) {}

  Runtime runtime;
  LoadedCallbacks callbacks;
};

// The arguments of `Finish`.
struct Loading {
  Game* game;
  const std::vector<Prototype>* prototypes;
};

// Takes the callbacks of the file that ran, and freezes what it made. Argument: the Loading.
int Finish(lua_State* L) {
  const Loading& loading = *static_cast<const Loading*>(lua_touserdata(L, 1));
  lua_pushglobaltable(L);
  const int globals = lua_gettop(L);
  lua_pushnil(L);
  lua_setmetatable(L, globals);
  loading.game->callbacks.Collect(L);
  Reach(L, globals, globals + 1);
  const int found = lua_gettop(L);
  const lua_Integer count = static_cast<lua_Integer>(lua_rawlen(L, found));
  for (lua_Integer i = 1; i <= count; i += kReachedStride) {
    if (lua_rawgeti(L, found, i + kReachedObject) == LUA_TFUNCTION) RequireNoKeptState(L, -1, *loading.prototypes);
    lua_pop(L, 1);
  }
  FreezeAll(L);
  SetUpWorldFields(L);
  PushContents(L, globals);
  RequireDefinedNames(L);
  return 0;
}

// Calls the function on top of the stack, below its arguments, while the file is loaded.
bool Call(Game& game, int arguments, tessera_game_error& error) {
  game.runtime.BeginCall(nullptr);
  const int status = lua_pcall(game.runtime.lua(), arguments, 0, kHandler);
  const bool failed = status != LUA_OK || game.runtime.ended();
  if (failed) WriteCallError(game.runtime, 0, error);
  return !failed;
}

// Compiles and runs the file. May throw std::bad_alloc.
bool LoadSource(Game& game, const tessera_game_source& source, tessera_game_error& error) {
  lua_State* const L = game.runtime.lua();
  lua_pushcfunction(L, HandleError);
  lua_pushcfunction(L, SetUpState);
  if (!Call(game, 0, error)) return false;

  game.runtime.BeginCall(nullptr);
  const std::string name = std::string("@") + source.name;
  if (luaL_loadbufferx(L, source.bytes, source.byte_count, name.c_str(), "t") != LUA_OK) {
    WriteCallError(game.runtime, 0, error);
    return false;
  }
  std::vector<Prototype> prototypes;
  std::string why;
  if (!ReadPrototypes(L, prototypes, why)) {
    WriteError(game.runtime.chunk(), why, error);
    return false;
  }
  if (!Call(game, 0, error)) return false;

  Loading loading{&game, &prototypes};
  lua_pushcfunction(L, Finish);
  lua_pushlightuserdata(L, &loading);
  if (!Call(game, 1, error)) return false;
  game.runtime.EndCall();
  lua_gc(L, LUA_GCCOLLECT);
  if (game.runtime.used_bytes() <= kLoadedBytes) return true;
  WriteError(game.runtime.chunk(), "too much memory: the file's tables and functions take more than 20 MiB", error);
  return false;
}

int Load(const tessera_game_host* host, const tessera_game_source* source, void** loaded, tessera_game_error* error) {
  *loaded = nullptr;
  if (source->byte_count > kMaxSourceBytes) {
    WriteError(source->name, "the file has more than 1 MiB", *error);
    return 1;
  }
  try {
    auto game = std::make_unique<Game>(host, source->name);
    if (game->runtime.lua() == nullptr) throw std::bad_alloc();
    if (!LoadSource(*game, *source, *error)) return 1;
    *loaded = game.release();
    return 0;
  } catch (const std::bad_alloc&) {
    WriteError(source->name, "too little memory to load it", *error);
    return 1;
  }
}

void Unload(void* game) { delete static_cast<Game*>(game); }

int Handles(const void* game, std::uint32_t callback, const char* kind) {
  return static_cast<const Game*>(game)->callbacks.Find(callback, kind) != 0 ? 1 : 0;
}

// Pushes the arguments of an event, and returns them. Argument: the event.
int PushArguments(lua_State* L) {
  const auto& event = *static_cast<const tessera_game_callback*>(lua_touserdata(L, 1));
  luaL_checkstack(L, static_cast<int>(event.count) + 8, nullptr);
  for (std::uint32_t i = 0; i < event.count; ++i) PushValue(L, event.arguments[i]);
  return static_cast<int>(event.count);
}

// Pushes the arguments of an event where that allocates nothing, and so cannot fail. Otherwise it pushes none of them.
bool PushedPlainArguments(lua_State* L, const tessera_game_callback& event) {
  constexpr std::uint32_t kMost = 8;  // Lua has so many places free outside of any function
  if (event.count > kMost) return false;
  for (std::uint32_t i = 0; i < event.count; ++i) {
    if (event.arguments[i].type == TESSERA_GAME_BODY && PushRecentHandle(L, event.arguments[i].as.id)) continue;
    lua_pop(L, static_cast<int>(i));
    return false;
  }
  return true;
}

// Calls the function with the event's arguments. Returns what lua_pcall does.
int CallWithArguments(lua_State* L, int reference, const tessera_game_callback& event) {
  lua_rawgeti(L, LUA_REGISTRYINDEX, reference);
  if (!PushedPlainArguments(L, event)) {
    lua_pushcfunction(L, PushArguments);
    lua_pushlightuserdata(L, const_cast<tessera_game_callback*>(&event));
    if (const int status = lua_pcall(L, 1, static_cast<int>(event.count), kHandler); status != LUA_OK) return status;
  }
  return lua_pcall(L, static_cast<int>(event.count), 0, kHandler);
}

// The line where the function is defined.
int LineOf(lua_State* L, int reference) {
  lua_Debug function;
  lua_rawgeti(L, LUA_REGISTRYINDEX, reference);
  lua_getinfo(L, ">S", &function);
  return function.linedefined;
}

int Run(void* loaded, tessera_game_call* call, const tessera_game_callback* event, tessera_game_error* error) {
  Game& game = *static_cast<Game*>(loaded);
  lua_State* const L = game.runtime.lua();
  const int reference = game.callbacks.FindAgain(event->callback, event->kind);
  if (reference == 0) {
    WriteError(game.runtime.chunk(), "the game has no such callback", *error);
    return 1;
  }
  game.runtime.BeginCall(call);
  const int status = CallWithArguments(L, reference, *event);
  const bool failed = status != LUA_OK || game.runtime.ended();
  if (failed) WriteCallError(game.runtime, LineOf(L, reference), *error);
  lua_settop(L, kHandler);
  game.runtime.EndCall();
  return failed ? 1 : 0;
}

constexpr tessera_game_module kModule = {sizeof kModule, TESSERA_GAME_ABI, Load, Unload, Handles, Run, nullptr};

}  // namespace

const tessera_game_module* LuaGameModule() { return &kModule; }

}  // namespace tessera::game
