// Vectors and rotations in Lua: values that do not change.
//
//   local up = vec(0, 1, 0)
//   local push = (other:position() - self:position()):normalized() * 3 + up
//
// Thread rule: as lua_State.
#pragma once

#include "game_sdk/lua/lua_state.h"
#include "lua.hpp"

namespace tessera::game {

struct Vector {
  double axes[3];
};
struct Rotation {
  double axes[4];  // x, y, z, w
};
static_assert(sizeof(Vector) == kUserBytes[kUserVector] && sizeof(Rotation) == kUserBytes[kUserRotation]);

void PushVector(lua_State* L, const Vector& vector);
void PushRotation(lua_State* L, const Rotation& rotation);

// vec(x, y, z)
int NewVector(lua_State* L);

// Fill the metatable on top.
void SetUpVectors(lua_State* L);
void SetUpRotations(lua_State* L);

}  // namespace tessera::game
