#include "game_sdk/lua/callbacks.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string_view>

#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/sorted_keys.h"
#include "game_sdk/lua/spelling.h"
#include "game_sdk/lua/values.h"

namespace tessera::game {
namespace {

// Raises an error about the value on top, with the line where it is defined if it is a function.
[[noreturn]] void RaiseAbout(lua_State* L, const char* text) {
  if (lua_isfunction(L, -1) && lua_iscfunction(L, -1) == 0) {
    lua_Debug function;
    lua_getinfo(L, ">S", &function);
    lua_pushfstring(L, "%s:%d: %s", function.short_src, function.linedefined, text);
  } else {
    lua_pushfstring(L, "%s: %s", Runtime::Of(L).chunk(), text);
  }
  lua_error(L);
  std::abort();
}

// Raises that the value on top is no callback; `path` names it.
[[noreturn]] void RaiseUnknown(lua_State* L, Receiver receiver, const char* path, const char* name) {
  Suggestion suggestion(name);
  for (const Callback& callback : Callbacks()) {
    if (callback.receiver == receiver) suggestion.Offer(callback.name);
  }
  char text[400];
  std::snprintf(text, sizeof text, "%s is no callback of %s%s%s%s", path,
                receiver == Receiver::kWorld ? "the world" : "bodies",
                suggestion.best().empty() ? "" : "; did you mean ",
                suggestion.best().empty() ? "" : suggestion.best().data(), suggestion.best().empty() ? "" : "?");
  RaiseAbout(L, text);
}

[[noreturn]] void RaiseNoFunction(lua_State* L, const char* path) {
  char text[300];
  std::snprintf(text, sizeof text, "%s must be a function, got %s", path, ValueName(L, -1));
  RaiseAbout(L, text);
}

}  // namespace

void LoadedCallbacks::Collect(lua_State* L) {
  const int globals = lua_gettop(L), list = globals + 1;
  lua_newtable(L);
  if (!AddKind("")) Raise(L, "too little memory");
  CollectWorld(L, globals, list);
  lua_pushliteral(L, "kinds");
  if (lua_rawget(L, globals) != LUA_TTABLE) RaiseAbout(L, "kinds must be a table of tables of callbacks");
  const int kinds = lua_gettop(L);
  PushSortedKeys(L, kinds, OtherKeys::kRefuse);
  const lua_Integer count = static_cast<lua_Integer>(lua_rawlen(L, kinds + 1));
  for (lua_Integer i = 1; i <= count; ++i) {
    if (lua_rawgeti(L, kinds + 1, i) != LUA_TSTRING) RaiseAbout(L, "kinds has a key that is no text");
    const char* const name = lua_tostring(L, -1);
    lua_pushvalue(L, -1);
    if (lua_rawget(L, kinds) != LUA_TTABLE) {
      char text[300];
      std::snprintf(text, sizeof text, "kinds.%.60s must be a table of callbacks, got %s", name, ValueName(L, -1));
      RaiseAbout(L, text);
    }
    if (!AddKind(name)) Raise(L, "too little memory");
    CollectKind(L, lua_gettop(L), list);
    lua_settop(L, kinds + 1);
  }
  lua_settop(L, list);
}

void LoadedCallbacks::Add(lua_State* L, const Callback& callback, int list) {
  lua_pushvalue(L, -1);
  lua_rawseti(L, list, static_cast<lua_Integer>(lua_rawlen(L, list)) + 1);
  kinds_.back().references[static_cast<std::size_t>(&callback - Callbacks().data())] = luaL_ref(L, LUA_REGISTRYINDEX);
}

void LoadedCallbacks::CollectWorld(lua_State* L, int globals, int list) {
  PushSortedKeys(L, globals, OtherKeys::kSkip);
  const int keys = lua_gettop(L);
  const lua_Integer count = static_cast<lua_Integer>(lua_rawlen(L, keys));
  for (lua_Integer i = 1; i <= count; ++i) {
    lua_rawgeti(L, keys, i);
    const char* const name = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "";
    lua_pushvalue(L, -1);
    lua_rawget(L, globals);
    const Callback* const callback = FindCallback(Receiver::kWorld, name);
    if (callback != nullptr) {
      if (!lua_isfunction(L, -1)) RaiseNoFunction(L, name);
      Add(L, *callback, list);
    } else if (std::strncmp(name, "on_", 3) == 0 && lua_isfunction(L, -1)) {
      RaiseUnknown(L, Receiver::kWorld, name, name);
    }
    lua_settop(L, keys);
  }
  lua_settop(L, keys - 1);
}

void LoadedCallbacks::CollectKind(lua_State* L, int entry, int list) {
  char path[160];
  PushSortedKeys(L, entry, OtherKeys::kRefuse);
  const lua_Integer count = static_cast<lua_Integer>(lua_rawlen(L, -1));
  for (lua_Integer i = 1; i <= count; ++i) {
    lua_rawgeti(L, entry + 1, i);
    const char* const name = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "[...]";
    lua_pushvalue(L, -1);
    lua_rawget(L, entry);
    std::snprintf(path, sizeof path, "kinds.%.60s.%.60s", kinds_.back().name.c_str(), name);
    if (FindCallback(Receiver::kBody, name) == nullptr) RaiseUnknown(L, Receiver::kBody, path, name);
    if (!lua_isfunction(L, -1)) RaiseNoFunction(L, path);
    lua_settop(L, entry + 1);
  }
  // An entry may also have callbacks by its metatable.
  for (const Callback& callback : Callbacks()) {
    if (callback.receiver != Receiver::kBody) continue;
    lua_pushlstring(L, callback.name.data(), callback.name.size());
    if (lua_gettable(L, entry) == LUA_TFUNCTION) Add(L, callback, list);
    lua_settop(L, entry + 1);
  }
}

// Called where Lua may raise errors, so it lets no exception out.
bool LoadedCallbacks::AddKind(const char* name) noexcept {
  try {
    kinds_.push_back({name, std::vector<int>(Callbacks().size())});
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

int LoadedCallbacks::Find(std::uint32_t number, const char* kind) const {
  const Callback* const callback = FindCallback(number);
  if (callback == nullptr || (kind == nullptr) != (callback->receiver == Receiver::kWorld)) return 0;
  const Kind* const entry = KindOf(kind);
  return entry == nullptr ? 0 : entry->references[static_cast<std::size_t>(callback - Callbacks().data())];
}

int LoadedCallbacks::FindAgain(std::uint32_t number, const char* kind) {
  if (kind == nullptr) return Find(number, kind);
  if (found_.callback == number && std::strcmp(found_.kind->c_str(), kind) == 0) return found_.reference;
  const int reference = Find(number, kind);
  if (reference != 0) found_ = {number, &KindOf(kind)->name, reference};
  return reference;
}

const LoadedCallbacks::Kind* LoadedCallbacks::KindOf(const char* kind) const {
  if (kind == nullptr) return &kinds_.front();
  const std::string_view name = kind;
  const auto found =
      std::partition_point(kinds_.begin() + 1, kinds_.end(), [&](const Kind& k) { return k.name < name; });
  return found == kinds_.end() || found->name != name ? nullptr : &*found;
}

}  // namespace tessera::game
