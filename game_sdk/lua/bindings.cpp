#include "game_sdk/lua/bindings.h"

#include <algorithm>
#include <cassert>

#include "game_sdk/lua/handles.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/spelling.h"
#include "game_sdk/lua/values.h"

namespace tessera::game {
namespace {

constexpr std::size_t kMaxArguments = 8;

// The names in the table are literals, and so are the views of them that printf gets here: each ends in a 0.

void RequireWorld(lua_State* L, std::string_view function) {
  if (Runtime::Of(L).call() == nullptr) {
    Raise(L, "%s: there is no world while the file is loaded", function.data());
  }
}

UserType UserTypeFor(Receiver receiver) { return receiver == Receiver::kBody ? kUserBody : kUserPlayer; }

// Converts the receiver, the first argument of a method.
void ToReceiver(lua_State* L, const Function& function, tessera_game_value& value) {
  const bool body = function.receiver == Receiver::kBody;
  if (UserTypeOf(L, 1) != UserTypeFor(function.receiver)) {
    const char* const name = body ? "body" : "player";
    Raise(L, "%s: call it as %s:%s(...), got %s in front", function.name.data(), name, function.name.data(),
          ValueName(L, 1));
  }
  value.type = body ? TESSERA_GAME_BODY : TESSERA_GAME_PLAYER;
  value.count = 0;
  value.as.id = static_cast<const Handle*>(lua_touserdata(L, 1))->id;
}

// Converts the arguments from stack position `first` on. Returns how many there are.
std::uint32_t ToArguments(lua_State* L, const Function& function, int first, tessera_game_value* arguments) {
  int last = lua_gettop(L);
  while (last >= first && lua_isnil(L, last)) --last;
  const int given = last - first + 1, taken = static_cast<int>(function.parameters.size());
  if (given > taken) {
    Raise(L, "%s: takes %d argument%s, got %d", function.name.data(), taken, taken == 1 ? "" : "s", given);
  }
  lua_settop(L, first + taken - 1);  // what conversions push comes behind all parameters
  std::uint32_t count = 0;
  for (const Parameter& parameter : function.parameters) {
    const int index = first + static_cast<int>(count);
    if (parameter.optional && index > last) break;
    const Types types = parameter.types | (parameter.optional ? kNothingType : 0);
    ToValue(L, index, types, {function.name, parameter.name, parameter.options}, arguments[count++]);
  }
  return count;
}

int CallFunction(lua_State* L) {
  const auto& function = *static_cast<const Function*>(lua_touserdata(L, lua_upvalueindex(1)));
  RequireWorld(L, function.name);
  tessera_game_value arguments[kMaxArguments], result;
  const std::uint32_t receivers = function.receiver == Receiver::kWorld ? 0 : 1;
  if (receivers != 0) ToReceiver(L, function, arguments[0]);
  const std::uint32_t count = ToArguments(L, function, static_cast<int>(receivers) + 1, arguments + receivers);
  CallHost(L, function, arguments, receivers + count, result);
  if (function.result == kNothingType) return 0;
  PushValue(L, result);
  return 1;
}

const Function& Numbered(FunctionNumber number) {
  const Function* const function = FindFunction(number);
  assert(function != nullptr);
  return *function;
}

// Writes the name of the property at index 2 and the body at index 1 to the first two arguments.
void ToProperty(lua_State* L, const Function& function, tessera_game_value* arguments) {
  RequireWorld(L, function.name);
  ToReceiver(L, function, arguments[0]);
  ToValue(L, 2, kTextType, {function.name, "name"}, arguments[1]);
}

[[noreturn]] void RaiseUnknownProperty(lua_State* L, std::string_view name) {
  Suggestion suggestion(name);
  Runtime& runtime = Runtime::Of(L);
  const bool suggest = runtime.TakeSuggestion();
  for (const Function& function : Functions()) {
    if (suggest && function.receiver == Receiver::kBody) suggestion.Offer(function.name);
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
    RaiseUnknownProperty(L, {arguments[1].as.text, arguments[1].count});
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
    lua_pushcclosure(L, CallFunction, 1);
    lua_rawset(L, -3);
  }
}

void SetUpBodyFields(lua_State* L) { SetUpFields(L, Receiver::kBody, ReadBodyField, WriteBodyField); }
void SetUpPlayerFields(lua_State* L) { SetUpFields(L, Receiver::kPlayer, ReadPlayerField, WritePlayerField); }

void CallHost(lua_State* L, const Function& function, const tessera_game_value* arguments, std::uint32_t count,
              tessera_game_value& result) {
  const Runtime& runtime = Runtime::Of(L);
  result = {};
  if (runtime.host()->call(runtime.call(), function.number, arguments, count, &result) != 0) {
    Raise(L, "%s", runtime.host()->error(runtime.call()));
  }
}

}  // namespace tessera::game
