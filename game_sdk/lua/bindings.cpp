#include "game_sdk/lua/bindings.h"

#include <algorithm>
#include <cassert>

#include "game_sdk/lua/freeze.h"
#include "game_sdk/lua/handles.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/spelling.h"
#include "game_sdk/lua/values.h"

namespace tessera::game {
namespace {

constexpr std::size_t kMaxArguments = 8;

// The names in the table are literals, and so are the views of them that printf gets here: each ends in a 0.

[[noreturn]] void RaiseNoWorld(lua_State* L, std::string_view function) {
  Raise(L, "%s: there is no world while the file is loaded", function.data());
}

inline void RequireWorld(lua_State* L, std::string_view function) {
  if (Runtime::Of(L).call() == nullptr) RaiseNoWorld(L, function);
}

[[noreturn]] void RaiseNoReceiver(lua_State* L, const Function& function) {
  Raise(L, "%s: call it as %s:%s(...), got %s in front", function.name.data(),
        function.receiver == Receiver::kBody ? "body" : "player", function.name.data(), ValueName(L, 1));
}

// Converts the receiver, the first argument of a method.
template <Receiver kReceiver>
inline void ToReceiver(lua_State* L, const Function& function, tessera_game_value& value) {
  constexpr UserType kType = kReceiver == Receiver::kBody ? kUserBody : kUserPlayer;
  const auto* const handle = static_cast<const Handle*>(lua_touserdata(L, 1));
  if (handle == nullptr || lua_rawlen(L, 1) != kUserBytes[kType]) RaiseNoReceiver(L, function);
  value.type = kReceiver == Receiver::kBody ? TESSERA_GAME_BODY : TESSERA_GAME_PLAYER;
  value.count = 0;
  value.as.id = handle->id;
}

// Converts the arguments from stack position `first` on. Returns how many there are.
std::uint32_t ToArguments(lua_State* L, const Function& function, int first, tessera_game_value* arguments) {
  int last = lua_gettop(L);
  while (last >= first && lua_isnil(L, last)) --last;
  const int given = last - first + 1, taken = static_cast<int>(function.parameters.size());
  if (given > taken) {
    Raise(L, "%s: takes %d argument%s, got %d", function.name.data(), taken, taken == 1 ? "" : "s", given);
  }
  lua_settop(L, first + taken - 1);  // values that conversions push come behind all parameters
  std::uint32_t count = 0;
  for (const Parameter& parameter : function.parameters) {
    const int index = first + static_cast<int>(count);
    if (parameter.optional && index > last) break;
    const Types types = parameter.types | (parameter.optional ? kNothingType : 0);
    ToValue(L, index, types, {function.name, parameter.name, parameter.options}, arguments[count++]);
  }
  return count;
}

// One for each receiver, because it is what games spend most of their time in.
template <Receiver kReceiver>
int CallFunction(lua_State* L) {
  const auto& function = *static_cast<const Function*>(lua_touserdata(L, lua_upvalueindex(1)));
  RequireWorld(L, function.name);
  tessera_game_value arguments[kMaxArguments], result;
  constexpr std::uint32_t kReceivers = kReceiver == Receiver::kWorld ? 0 : 1;
  if constexpr (kReceivers != 0) ToReceiver<kReceiver>(L, function, arguments[0]);
  std::uint32_t count = kReceivers;
  if (!function.parameters.empty() || lua_gettop(L) > static_cast<int>(kReceivers)) {
    count += ToArguments(L, function, static_cast<int>(kReceivers) + 1, arguments + kReceivers);
    luaL_checkstack(L, 8, nullptr);
  }
  CallHost(L, function, arguments, count, result);
  if (function.result == kNothingType) return 0;
  PushValue(L, result);
  return 1;
}

lua_CFunction CallerOf(Receiver receiver) {
  switch (receiver) {
    case Receiver::kBody:
      return CallFunction<Receiver::kBody>;
    case Receiver::kPlayer:
      return CallFunction<Receiver::kPlayer>;
    default:
      return CallFunction<Receiver::kWorld>;
  }
}

const Function& Numbered(FunctionNumber number) {
  const Function* const function = FindFunction(number);
  assert(function != nullptr);
  return *function;
}

// Writes the name of the property at index 2 and the body at index 1 to the first two arguments.
void ToProperty(lua_State* L, const Function& function, tessera_game_value* arguments) {
  RequireWorld(L, function.name);
  ToReceiver<Receiver::kBody>(L, function, arguments[0]);
  ToValue(L, 2, kTextType, {function.name, "name"}, arguments[1]);
}

[[noreturn]] void RaiseUnknownProperty(lua_State* L, Receiver receiver, std::string_view name) {
  Suggestion suggestion(name);
  Runtime& runtime = Runtime::Of(L);
  const bool suggest = runtime.TakeSuggestion();
  for (const Function& function : Functions()) {
    if (suggest && function.receiver == receiver) suggestion.Offer(function.name);
  }
  const char* const why = runtime.host()->error(runtime.call());
  if (suggestion.best().empty()) Raise(L, "%s", why);
  Raise(L, "%s; did you mean the function %s?", why, suggestion.best().data());
}

// __index of bodies; upvalue 1 holds the methods.
int ReadBodyField(lua_State* L) {
  lua_pushvalue(L, 2);
  if (lua_rawget(L, lua_upvalueindex(1)) != LUA_TNIL) return 1;
  static const Function& get = Numbered(kBodyGet);
  tessera_game_value arguments[2], result;
  ToProperty(L, get, arguments);
  const Runtime& runtime = Runtime::Of(L);
  if (runtime.host()->call(runtime.call(), get.number, arguments, 2, &result) != 0) {
    RaiseUnknownProperty(L, Receiver::kBody, {arguments[1].as.text, arguments[1].count});
  }
  PushValue(L, result);
  return 1;
}

// __newindex of bodies; upvalue 1 holds the methods.
int WriteBodyField(lua_State* L) {
  lua_pushvalue(L, 2);
  if (lua_rawget(L, lua_upvalueindex(1)) != LUA_TNIL) {
    Raise(L, "`%.60s` is a function of bodies, and no property", lua_tostring(L, 2));
  }
  static const Function& set = Numbered(kBodySet);
  tessera_game_value arguments[3], result;
  ToProperty(L, set, arguments);
  const std::string_view name(arguments[1].as.text, std::min<std::uint32_t>(arguments[1].count, 60));
  ToValue(L, 3, set.parameters[1].types, {set.name, name}, arguments[2]);
  CallHost(L, set, arguments, 3, result);
  return 0;
}

// __index of what the frozen world holds: what is not a function there is a property of the world.
int ReadWorldField(lua_State* L) {
  if (lua_type(L, 2) != LUA_TSTRING) return 0;
  static const Function& get = Numbered(kWorldGet);
  RequireWorld(L, get.name);
  tessera_game_value argument, result;
  ToValue(L, 2, kTextType, {get.name, "name"}, argument);
  const Runtime& runtime = Runtime::Of(L);
  if (runtime.host()->call(runtime.call(), get.number, &argument, 1, &result) != 0) {
    RaiseUnknownProperty(L, Receiver::kWorld, {argument.as.text, argument.count});
  }
  PushValue(L, result);
  return 1;
}

// __newindex of the frozen world.
int WriteWorldField(lua_State* L) {
  PushContents(L, 1);
  lua_pushvalue(L, 2);
  if (lua_rawget(L, -2) != LUA_TNIL || lua_type(L, 2) != LUA_TSTRING) RaiseFrozen(L, 1, 2);
  static const Function& set = Numbered(kWorldSet);
  RequireWorld(L, set.name);
  tessera_game_value arguments[2], result;
  ToValue(L, 2, kTextType, {set.name, "name"}, arguments[0]);
  const std::string_view name(arguments[0].as.text, std::min<std::uint32_t>(arguments[0].count, 60));
  ToValue(L, 3, set.parameters[1].types, {set.name, name}, arguments[1]);
  CallHost(L, set, arguments, 2, result);
  return 0;
}

const char kWorldKey = 'w';  // registry: the table of the functions of the world

int ReadPlayerField(lua_State* L) {
  lua_pushvalue(L, 2);
  if (lua_rawget(L, lua_upvalueindex(1)) != LUA_TNIL) return 1;
  if (lua_type(L, 2) == LUA_TSTRING) Raise(L, "a player has no `%.60s`", lua_tostring(L, 2));
  Raise(L, "a player has no field that is %s", ValueName(L, 2));
}

int WritePlayerField(lua_State* L) { Raise(L, "a player has no fields that can be written"); }

void SetUpFields(lua_State* L, Receiver receiver, lua_CFunction read, lua_CFunction write) {
  PushFunctions(L, receiver);
  lua_pushvalue(L, -1);
  lua_pushcclosure(L, read, 1);
  lua_setfield(L, -3, "__index");
  lua_pushcclosure(L, write, 1);
  lua_setfield(L, -2, "__newindex");
}

}  // namespace

void PushFunctions(lua_State* L, Receiver receiver) {
  lua_newtable(L);
  for (const Function& function : Functions()) {
    if (function.receiver != receiver) continue;
    assert(function.parameters.size() < kMaxArguments);
    lua_pushlstring(L, function.name.data(), function.name.size());
    lua_pushlightuserdata(L, const_cast<Function*>(&function));
    lua_pushcclosure(L, CallerOf(receiver), 1);
    lua_rawset(L, -3);
  }
}

void SetUpBodyFields(lua_State* L) { SetUpFields(L, Receiver::kBody, ReadBodyField, WriteBodyField); }
void SetUpPlayerFields(lua_State* L) { SetUpFields(L, Receiver::kPlayer, ReadPlayerField, WritePlayerField); }

void PushWorld(lua_State* L) {
  PushFunctions(L, Receiver::kWorld);
  lua_pushvalue(L, -1);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &kWorldKey);
}

void SetUpWorldFields(lua_State* L) {
  const int top = lua_gettop(L);
  lua_rawgetp(L, LUA_REGISTRYINDEX, &kWorldKey);
  const int world = top + 1;
  if (IsFrozen(L, world)) {
    PushContents(L, world);
    if (lua_getmetatable(L, -1) == 0) {
      lua_createtable(L, 0, 1);
      lua_pushcfunction(L, ReadWorldField);
      lua_setfield(L, -2, "__index");
      lua_setmetatable(L, -2);
    }
    lua_getmetatable(L, world);
    lua_pushcfunction(L, WriteWorldField);
    lua_setfield(L, -2, "__newindex");
  }
  lua_settop(L, top);
}

}  // namespace tessera::game
