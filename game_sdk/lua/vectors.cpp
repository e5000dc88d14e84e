#include "game_sdk/lua/vectors.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <string_view>

#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/values.h"

namespace tessera::game {
namespace {

Vector operator+(const Vector& a, const Vector& b) {
  return {{a.axes[0] + b.axes[0], a.axes[1] + b.axes[1], a.axes[2] + b.axes[2]}};
}
Vector operator-(const Vector& a, const Vector& b) {
  return {{a.axes[0] - b.axes[0], a.axes[1] - b.axes[1], a.axes[2] - b.axes[2]}};
}
Vector operator*(const Vector& a, double factor) {
  return {{a.axes[0] * factor, a.axes[1] * factor, a.axes[2] * factor}};
}
double DotOf(const Vector& a, const Vector& b) {
  return a.axes[0] * b.axes[0] + a.axes[1] * b.axes[1] + a.axes[2] * b.axes[2];
}
Vector CrossOf(const Vector& a, const Vector& b) {
  return {{a.axes[1] * b.axes[2] - a.axes[2] * b.axes[1], a.axes[2] * b.axes[0] - a.axes[0] * b.axes[2],
           a.axes[0] * b.axes[1] - a.axes[1] * b.axes[0]}};
}

const Vector& ToVector(lua_State* L, int index, const char* operation) {
  if (UserTypeOf(L, index) != kUserVector) Raise(L, "%s: needs a vector, got %s", operation, ValueName(L, index));
  return *static_cast<const Vector*>(lua_touserdata(L, index));
}

double ToReal(lua_State* L, int index, const char* operation) {
  if (lua_type(L, index) != LUA_TNUMBER) Raise(L, "%s: needs a number, got %s", operation, ValueName(L, index));
  return lua_tonumber(L, index);
}

int Add(lua_State* L) {
  PushVector(L, ToVector(L, 1, "vector +") + ToVector(L, 2, "vector +"));
  return 1;
}

int Subtract(lua_State* L) {
  PushVector(L, ToVector(L, 1, "vector -") - ToVector(L, 2, "vector -"));
  return 1;
}

int Multiply(lua_State* L) {
  const int vector = lua_type(L, 1) == LUA_TNUMBER ? 2 : 1;
  if (UserTypeOf(L, 3 - vector) == kUserVector) Raise(L, "vector *: use v:dot(w) or v:cross(w) for two vectors");
  PushVector(L, ToVector(L, vector, "vector *") * ToReal(L, 3 - vector, "vector *"));
  return 1;
}

int Divide(lua_State* L) {
  const Vector& vector = ToVector(L, 1, "vector /");
  const double divisor = ToReal(L, 2, "vector /");
  PushVector(L, {{vector.axes[0] / divisor, vector.axes[1] / divisor, vector.axes[2] / divisor}});
  return 1;
}

int Negate(lua_State* L) {
  PushVector(L, ToVector(L, 1, "vector -") * -1);
  return 1;
}

int SameVector(lua_State* L) {
  const bool vectors = UserTypeOf(L, 1) == kUserVector && UserTypeOf(L, 2) == kUserVector;
  const auto* const a = static_cast<const Vector*>(lua_touserdata(L, 1));
  const auto* const b = static_cast<const Vector*>(lua_touserdata(L, 2));
  lua_pushboolean(L, vectors && a->axes[0] == b->axes[0] && a->axes[1] == b->axes[1] && a->axes[2] == b->axes[2]);
  return 1;
}

int Length(lua_State* L) {
  const Vector& vector = ToVector(L, 1, "length");
  lua_pushnumber(L, std::sqrt(DotOf(vector, vector)));
  return 1;
}

int Dot(lua_State* L) {
  lua_pushnumber(L, DotOf(ToVector(L, 1, "dot"), ToVector(L, 2, "dot")));
  return 1;
}

int Cross(lua_State* L) {
  PushVector(L, CrossOf(ToVector(L, 1, "cross"), ToVector(L, 2, "cross")));
  return 1;
}

// The vector without a direction stays as it is.
int Normalized(lua_State* L) {
  const Vector& vector = ToVector(L, 1, "normalized");
  const double length = std::sqrt(DotOf(vector, vector));
  PushVector(
      L, length > 0 ? Vector{{vector.axes[0] / length, vector.axes[1] / length, vector.axes[2] / length}} : Vector{});
  return 1;
}

// v + 2 w (q x v) + 2 q x (q x v), for a unit quaternion (q, w).
int Apply(lua_State* L) {
  if (UserTypeOf(L, 1) != kUserRotation) Raise(L, "apply: call it as rotation:apply(vector)");
  const double* const axes = static_cast<const Rotation*>(lua_touserdata(L, 1))->axes;
  const Vector& vector = ToVector(L, 2, "apply");
  const Vector axis{{axes[0], axes[1], axes[2]}};
  const Vector twice = CrossOf(axis, vector) * 2;
  PushVector(L, vector + twice * axes[3] + CrossOf(axis, twice));
  return 1;
}

int VectorToText(lua_State* L) {
  const bool rotation = UserTypeOf(L, 1) == kUserRotation;
  const auto* const axes = static_cast<const double*>(lua_touserdata(L, 1));
  char text[128];
  if (rotation) {
    std::snprintf(text, sizeof text, "(%.14g, %.14g, %.14g, %.14g)", axes[0], axes[1], axes[2], axes[3]);
  } else {
    std::snprintf(text, sizeof text, "(%.14g, %.14g, %.14g)", axes[0], axes[1], axes[2]);
  }
  lua_pushstring(L, text);
  return 1;
}

// __index: the letters of upvalue 2 name the numbers, upvalue 1 holds the methods.
int Index(lua_State* L) {
  if (lua_type(L, 2) == LUA_TSTRING) {
    std::size_t bytes = 0;
    const char* const name = lua_tolstring(L, 2, &bytes);
    const char* const letters = lua_tostring(L, lua_upvalueindex(2));
    if (const char* const found = bytes == 1 ? std::strchr(letters, name[0]) : nullptr; found != nullptr) {
      lua_pushnumber(L, static_cast<const double*>(lua_touserdata(L, 1))[found - letters]);
      return 1;
    }
    lua_pushvalue(L, 2);
    if (lua_rawget(L, lua_upvalueindex(1)) != LUA_TNIL) return 1;
    Raise(L, "%s has no `%.60s`", ValueName(L, 1), name);
  }
  Raise(L, "%s has no field that is %s", ValueName(L, 1), ValueName(L, 2));
}

int Write(lua_State* L) {
  Raise(L, "%s does not change; make another one, like vec(v.x, v.y + 1, v.z)", ValueName(L, 1));
}

void SetUp(lua_State* L, const char* letters, const luaL_Reg* methods) {
  lua_newtable(L);
  luaL_setfuncs(L, methods, 0);
  lua_pushstring(L, letters);
  lua_pushcclosure(L, Index, 2);
  lua_setfield(L, -2, "__index");
  lua_pushcfunction(L, Write);
  lua_setfield(L, -2, "__newindex");
  lua_pushcfunction(L, VectorToText);
  lua_setfield(L, -2, "__tostring");
}

void Push(lua_State* L, UserType type, const double* axes) {
  std::memcpy(lua_newuserdatauv(L, kUserBytes[type], 0), axes, kUserBytes[type]);
  lua_rawgeti(L, LUA_REGISTRYINDEX, Runtime::Of(L).metatable_references[type]);
  lua_setmetatable(L, -2);
}

}  // namespace

void PushVector(lua_State* L, const Vector& vector) { Push(L, kUserVector, vector.axes); }
void PushRotation(lua_State* L, const Rotation& rotation) { Push(L, kUserRotation, rotation.axes); }

int NewVector(lua_State* L) {
  if (lua_gettop(L) != 3) Raise(L, "vec: takes 3 numbers, got %d values", lua_gettop(L));
  PushVector(L, {{ToReal(L, 1, "vec"), ToReal(L, 2, "vec"), ToReal(L, 3, "vec")}});
  return 1;
}

void SetUpVectors(lua_State* L) {
  constexpr luaL_Reg kMethods[] = {
      {"length", Length}, {"dot", Dot}, {"cross", Cross}, {"normalized", Normalized}, {nullptr, nullptr}};
  constexpr luaL_Reg kOperators[] = {{"__add", Add},    {"__sub", Subtract},  {"__mul", Multiply}, {"__div", Divide},
                                     {"__unm", Negate}, {"__eq", SameVector}, {nullptr, nullptr}};
  SetUp(L, "xyz", kMethods);
  luaL_setfuncs(L, kOperators, 0);
  lua_pushliteral(L, "vector");
  lua_setfield(L, -2, "__name");
}

void SetUpRotations(lua_State* L) {
  constexpr luaL_Reg kMethods[] = {{"apply", Apply}, {nullptr, nullptr}};
  SetUp(L, "xyzw", kMethods);
  lua_pushliteral(L, "rotation");
  lua_setfield(L, -2, "__name");
}

}  // namespace tessera::game
