#include "game_sdk/testing/script_run.h"

#include <cmath>
#include <cstring>

#include "game_sdk/lua/error_text.h"
#include "game_sdk/lua/handles.h"
#include "game_sdk/lua/limits.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/sandbox.h"
#include "game_sdk/lua/values.h"
#include "game_sdk/lua/vectors.h"

namespace tessera::game {
namespace {

// The message handler stays at the bottom of the stack.
constexpr int kScriptHandler = 1;
constexpr lua_Integer kMaxScriptTicks = 1'000'000;  // the most that one call of step makes
const char kTestsKey = 't';                         // registry: a list of name and function, in turn

// --- What `t` does. Its functions have t at index 1.

ScriptWorld& WorldOf(lua_State* L) {
  Runtime& runtime = Runtime::Of(L);
  if (!lua_istable(L, 1)) Raise(L, "call it as t:name(...), with a colon");
  return ScriptWorld::Of(runtime.call());
}

void Require(lua_State* L, bool done, const ScriptWorld& world) {
  if (!done) Raise(L, "%s", world.error().c_str());
}

BodyId BodyAt(lua_State* L, int index, const char* function) {
  if (UserTypeOf(L, index) != kUserBody) Raise(L, "%s: expected a body, got %s", function, ValueName(L, index));
  return BodyId(static_cast<const Handle*>(lua_touserdata(L, index))->id);
}

// The result is nullptr for nil.
const double* VectorAt(lua_State* L, int index, const char* function, const char* name) {
  if (lua_isnoneornil(L, index)) return nullptr;
  if (UserTypeOf(L, index) != kUserVector) {
    Raise(L, "%s: `%s` must be a vector, got %s", function, name, ValueName(L, index));
  }
  return static_cast<const Vector*>(lua_touserdata(L, index))->axes;
}

// Each step has a budget of its own.
void StepOnce(lua_State* L, ScriptWorld& world) {
  Require(L, world.Step(), world);
  Runtime& runtime = Runtime::Of(L);
  runtime.EndCall();
  runtime.BeginCall(world.AsCall());
}

lua_Integer TicksAt(lua_State* L, int index, const char* function) {
  const lua_Integer ticks = luaL_optinteger(L, index, 1);
  if (ticks < 1 || ticks > kMaxScriptTicks) Raise(L, "%s: takes 1 to 1 000 000 ticks", function);
  return ticks;
}

int TestStep(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  for (lua_Integer left = TicksAt(L, 2, "step"); left > 0; --left) StepOnce(L, world);
  return 0;
}

// step_until(ticks, condition): the number of ticks that it took.
int TestStepUntil(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  const lua_Integer most = TicksAt(L, 2, "step_until");
  luaL_checktype(L, 3, LUA_TFUNCTION);
  for (lua_Integer done = 1; done <= most; ++done) {
    StepOnce(L, world);
    lua_pushvalue(L, 3);
    lua_call(L, 0, 1);
    const bool reached = lua_toboolean(L, -1) != 0;
    lua_pop(L, 1);
    if (!reached) continue;
    lua_pushinteger(L, done);
    return 1;
  }
  Raise(L, "step_until: not within %lld ticks", static_cast<long long>(most));
}

int TestTick(lua_State* L) {
  lua_pushinteger(L, static_cast<lua_Integer>(WorldOf(L).world().tick().value()));
  return 1;
}

int TestBody(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  BodyId body;
  if (lua_type(L, 2) == LUA_TSTRING) {
    std::size_t bytes = 0;
    const char* const name = lua_tolstring(L, 2, &bytes);
    Require(L, world.FindBody(std::string_view(name, bytes), body), world);
  } else {
    body = BodyId(static_cast<std::uint64_t>(luaL_checkinteger(L, 2)));
    Require(L, world.FindBody(body), world);
  }
  PushHandle(L, kUserBody, body.value());
  return 1;
}

int TestBodies(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  std::size_t bytes = 0;
  const char* const text = luaL_optlstring(L, 2, nullptr, &bytes);
  const std::string_view kind(text == nullptr ? "" : text, text == nullptr ? 0 : bytes);
  Require(L, world.ListBodies(text == nullptr ? nullptr : &kind), world);
  lua_newtable(L);
  lua_Integer place = 0;
  for (const BodyId body : world.bodies()) {
    PushHandle(L, kUserBody, body.value());
    lua_rawseti(L, -2, ++place);
  }
  return 1;
}

// place(body, { position = v, rotation = r, velocity = v, spin = v })
int TestPlace(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  const BodyId body = BodyAt(L, 2, "place");
  luaL_checktype(L, 3, LUA_TTABLE);
  Placing placing;
  for (lua_pushnil(L); lua_next(L, 3) != 0; lua_pop(L, 1)) {
    const char* const key = lua_type(L, -2) == LUA_TSTRING ? lua_tostring(L, -2) : "";
    if (std::strcmp(key, "position") == 0) {
      placing.position = VectorAt(L, -1, "place", key);
    } else if (std::strcmp(key, "velocity") == 0) {
      placing.velocity = VectorAt(L, -1, "place", key);
    } else if (std::strcmp(key, "spin") == 0) {
      placing.spin = VectorAt(L, -1, "place", key);
    } else if (std::strcmp(key, "rotation") == 0 && UserTypeOf(L, -1) == kUserRotation) {
      placing.rotation = static_cast<const Rotation*>(lua_touserdata(L, -1))->axes;
    } else {
      Raise(L, "place: takes position, velocity and spin (vectors) and rotation, got `%.60s`", key);
    }
  }
  Require(L, world.Place(body, placing), world);
  return 0;
}

int TestKillRegionOf(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  Require(L, world.Kill(BodyAt(L, 2, "kill_region_of")), world);
  return 0;
}

int TestRegionOf(lua_State* L) {
  const ScriptWorld& world = WorldOf(L);
  lua_pushinteger(L, world.world().OwnerOf(BodyAt(L, 2, "region_of")).value());
  return 1;
}

int TestRegions(lua_State* L) {
  lua_pushinteger(L, static_cast<lua_Integer>(WorldOf(L).world().live_regions()));
  return 1;
}

// A player's body, or a player.
BodyId PlayerAt(lua_State* L, int index, const char* function) {
  if (UserTypeOf(L, index) != kUserPlayer) return BodyAt(L, index, function);
  const std::uint64_t number = static_cast<const Handle*>(lua_touserdata(L, index))->id;
  return PlayerBodyId(PlayerNumber(static_cast<std::uint32_t>(number)));
}

// command(player, bytes)
int TestCommand(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  const BodyId body = PlayerAt(L, 2, "command");
  std::size_t size = 0;
  const char* const bytes = luaL_checklstring(L, 3, &size);
  Require(L, world.Command(body, {bytes, size}), world);
  return 0;
}

// events(player): a list of tables with `name` and `values`.
int TestEvents(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  Require(L, world.TakeEvents(PlayerAt(L, 2, "events")), world);
  lua_newtable(L);
  lua_Integer place = 0;
  for (const LockstepWorld::Event& event : world.events()) {
    lua_createtable(L, 0, 2);
    lua_pushlstring(L, event.name.data(), event.name.size());
    lua_setfield(L, -2, "name");
    lua_newtable(L);
    for (const auto& [name, value] : event.values) {
      lua_pushlstring(L, name.data(), name.size());
      PushValue(L, ToInterface(value));
      lua_rawset(L, -3);
    }
    lua_setfield(L, -2, "values");
    lua_rawseti(L, -2, ++place);
  }
  return 1;
}

// ended(player): why the game sent the player away, or nil.
int TestEnded(lua_State* L) {
  const ScriptWorld& world = WorldOf(L);
  const std::string* const why = world.EndedBecause(PlayerAt(L, 2, "ended"));
  if (why == nullptr) return 0;
  lua_pushlstring(L, why->data(), why->size());
  return 1;
}

// join([name])
int TestJoin(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  std::size_t size = 0;
  const char* const name = luaL_optlstring(L, 2, "", &size);
  BodyId body;
  Require(L, world.Join({name, size}, body), world);
  PushHandle(L, kUserBody, body.value());
  return 1;
}

int TestLeave(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  Require(L, world.Leave(PlayerAt(L, 2, "leave")), world);
  return 0;
}

int TestInput(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  const BodyId body = BodyAt(L, 2, "input");
  const double* const force = VectorAt(L, 3, "input", "force");
  if (force == nullptr) Raise(L, "input: `force` is missing");
  Require(L, world.Input(body, force, VectorAt(L, 4, "input", "torque")), world);
  return 0;
}

// A number that a float can hold.
float SteeringAt(lua_State* L, int index, const char* key) {
  const auto value = static_cast<float>(lua_tonumber(L, index));
  if (lua_type(L, index) != LUA_TNUMBER || !std::isfinite(value)) {
    Raise(L, "steer: `%s` must be a finite number, got %s", key, ValueName(L, index));
  }
  return value;
}

// steer(player, { right = r, forward = f, yaw = y, pitch = p, buttons = b })
int TestSteer(lua_State* L) {
  ScriptWorld& world = WorldOf(L);
  const BodyId body = PlayerAt(L, 2, "steer");
  luaL_checktype(L, 3, LUA_TTABLE);
  PlayerInput steering;
  for (lua_pushnil(L); lua_next(L, 3) != 0; lua_pop(L, 1)) {
    const char* const key = lua_type(L, -2) == LUA_TSTRING ? lua_tostring(L, -2) : "";
    if (std::strcmp(key, "right") == 0) {
      steering.move.x = SteeringAt(L, -1, key);
    } else if (std::strcmp(key, "forward") == 0) {
      steering.move.y = SteeringAt(L, -1, key);
    } else if (std::strcmp(key, "yaw") == 0) {
      steering.yaw_rad = SteeringAt(L, -1, key);
    } else if (std::strcmp(key, "pitch") == 0) {
      steering.pitch_rad = SteeringAt(L, -1, key);
    } else if (std::strcmp(key, "buttons") == 0 && lua_isinteger(L, -1) != 0 && lua_tointeger(L, -1) >= 0 &&
               lua_tointeger(L, -1) <= lua_Integer{UINT32_MAX}) {
      steering.buttons = static_cast<std::uint32_t>(lua_tointeger(L, -1));
    } else {
      Raise(L, "steer: takes right, forward, yaw, pitch (numbers) and buttons (bits), got `%.60s`", key);
    }
  }
  Require(L, world.Steer(body, steering), world);
  return 0;
}

void PushList(lua_State* L, const std::vector<std::string>& texts) {
  lua_newtable(L);
  lua_Integer place = 0;
  for (const std::string& text : texts) {
    lua_pushlstring(L, text.data(), text.size());
    lua_rawseti(L, -2, ++place);
  }
}

int TestLines(lua_State* L) {
  PushList(L, WorldOf(L).lines());
  return 1;
}

int TestErrors(lua_State* L) {
  PushList(L, WorldOf(L).errors());
  return 1;
}

int TestAllowErrors(lua_State* L) {
  WorldOf(L).AllowErrors();
  return 0;
}

// The text at `index` in front of a failure.
const char* Label(lua_State* L, int index) { return lua_isnoneornil(L, index) ? "" : luaL_checkstring(L, index); }

int TestExpect(lua_State* L) {
  WorldOf(L);
  luaL_checkany(L, 2);
  const char* const label = Label(L, 3);
  if (lua_toboolean(L, 2) != 0) return 0;
  const char* const got = PushText(L, 2, nullptr);
  if (label[0] != '\0') Raise(L, "%.200s", label);
  Raise(L, "expected something true, got %.100s", got);
}

[[noreturn]] void RaiseDifferent(lua_State* L, const char* label, const char* how) {
  const char* const got = PushText(L, 2, nullptr);
  const char* const expected = PushText(L, 3, nullptr);
  Raise(L, "%.100s%sgot %.100s, expected %.100s%s", label, label[0] == '\0' ? "" : ": ", got, expected, how);
}

int TestExpectEqual(lua_State* L) {
  WorldOf(L);
  luaL_checkany(L, 2);
  lua_settop(L, 4);
  const char* const label = Label(L, 4);
  if (lua_compare(L, 2, 3, LUA_OPEQ) == 0) RaiseDifferent(L, label, "");
  return 0;
}

int TestExpectNear(lua_State* L) {
  WorldOf(L);
  lua_settop(L, 5);
  const lua_Number tolerance = luaL_checknumber(L, 4);
  const char* const label = Label(L, 5);
  double off = 0;
  if (UserTypeOf(L, 2) == kUserVector && UserTypeOf(L, 3) == kUserVector) {
    const double* const a = VectorAt(L, 2, "expect_near", "got");
    const double* const b = VectorAt(L, 3, "expect_near", "expected");
    off = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  } else {
    off = std::abs(luaL_checknumber(L, 2) - luaL_checknumber(L, 3));
  }
  char how[40];
  std::snprintf(how, sizeof how, " +- %g", tolerance);
  if (!(off <= tolerance)) RaiseDifferent(L, label, how);
  return 0;
}

constexpr luaL_Reg kTestFunctions[] = {{"step", TestStep},
                                       {"step_until", TestStepUntil},
                                       {"tick", TestTick},
                                       {"body", TestBody},
                                       {"bodies", TestBodies},
                                       {"place", TestPlace},
                                       {"kill_region_of", TestKillRegionOf},
                                       {"region_of", TestRegionOf},
                                       {"regions", TestRegions},
                                       {"join", TestJoin},
                                       {"leave", TestLeave},
                                       {"command", TestCommand},
                                       {"events", TestEvents},
                                       {"ended", TestEnded},
                                       {"input", TestInput},
                                       {"steer", TestSteer},
                                       {"lines", TestLines},
                                       {"errors", TestErrors},
                                       {"allow_errors", TestAllowErrors},
                                       {"expect", TestExpect},
                                       {"expect_equal", TestExpectEqual},
                                       {"expect_near", TestExpectNear},
                                       {nullptr, nullptr}};

// --- Loading

// test(name, function)
int AddTest(lua_State* L) {
  luaL_checktype(L, 1, LUA_TSTRING);
  luaL_checktype(L, 2, LUA_TFUNCTION);
  if (Runtime::Of(L).call() != nullptr) Raise(L, "test: a test within a test");
  lua_rawgetp(L, LUA_REGISTRYINDEX, &kTestsKey);
  const auto count = static_cast<lua_Integer>(lua_rawlen(L, 3));
  if (static_cast<std::size_t>(count) >= 2 * kMaxTests) Raise(L, "test: more than 1000 tests");
  for (lua_Integer i = 1; i <= count; i += 2) {
    lua_rawgeti(L, 3, i);
    if (lua_rawequal(L, -1, 1) != 0) Raise(L, "test: there are two called \"%.60s\"", lua_tostring(L, 1));
    lua_pop(L, 1);
  }
  lua_pushvalue(L, 1);
  lua_rawseti(L, 3, count + 1);
  lua_pushvalue(L, 2);
  lua_rawseti(L, 3, count + 2);
  return 0;
}

int SetUpScript(lua_State* L) {
  SetUpState(L);
  lua_newtable(L);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &kTestsKey);
  lua_pushglobaltable(L);
  lua_pushliteral(L, "kinds");
  lua_pushnil(L);
  lua_rawset(L, -3);
  lua_pushliteral(L, "test");
  lua_pushcfunction(L, AddTest);
  lua_rawset(L, -3);
  return 0;
}

// Calls the function on top of the stack, below its arguments. Returns the error, or nothing.
std::string CallScript(Runtime& runtime, tessera_game_call* call, int arguments) {
  runtime.BeginCall(call);
  const int status = lua_pcall(runtime.lua(), arguments, 0, kScriptHandler);
  if (status == LUA_OK && !runtime.ended()) return "";
  tessera_game_error error{};
  WriteCallError(runtime, 0, error);
  lua_settop(runtime.lua(), kScriptHandler);
  return error.text;
}

std::string LoadScript(Runtime& runtime, const GameFile& script) {
  lua_State* const L = runtime.lua();
  if (L == nullptr) return script.name + ": too little memory";
  if (script.bytes.size() > kMaxSourceBytes) return script.name + ": the file has more than 1 MiB";
  lua_pushcfunction(L, HandleError);
  lua_pushcfunction(L, SetUpScript);
  if (std::string error = CallScript(runtime, nullptr, 0); !error.empty()) return error;
  runtime.BeginCall(nullptr);
  if (luaL_loadbufferx(L, script.bytes.data(), script.bytes.size(), ("@" + script.name).c_str(), "t") != LUA_OK) {
    tessera_game_error error{};
    WriteCallError(runtime, 0, error);
    return error.text;
  }
  return CallScript(runtime, nullptr, 0);
}

}  // namespace

absl::StatusOr<std::vector<std::string>> ListTests(const GameFile& script) {
  Runtime runtime(&ScriptWorld::Host(), script.name.c_str());
  if (std::string error = LoadScript(runtime, script); !error.empty()) return absl::InvalidArgumentError(error);
  lua_State* const L = runtime.lua();
  std::vector<std::string> names;
  lua_rawgetp(L, LUA_REGISTRYINDEX, &kTestsKey);
  const auto count = static_cast<lua_Integer>(lua_rawlen(L, -1));
  for (lua_Integer i = 1; i <= count; i += 2) {
    lua_rawgeti(L, -1, i);
    std::size_t bytes = 0;
    const char* const name = lua_tolstring(L, -1, &bytes);
    names.emplace_back(name, bytes);
    lua_pop(L, 1);
  }
  return names;
}

std::string RunTest(const GameFile& script, std::size_t index, ScriptWorld& world) {
  Runtime runtime(&ScriptWorld::Host(), script.name.c_str());
  if (std::string error = LoadScript(runtime, script); !error.empty()) return error;
  lua_State* const L = runtime.lua();
  lua_rawgetp(L, LUA_REGISTRYINDEX, &kTestsKey);
  lua_rawgeti(L, -1, 2 * static_cast<lua_Integer>(index) + 2);
  lua_remove(L, -2);
  luaL_newlib(L, kTestFunctions);
  return CallScript(runtime, world.AsCall(), 1);
}

}  // namespace tessera::game
