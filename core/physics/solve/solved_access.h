// Access to kernel.h's bodies for passes that take them one by one. It stands apart from kernel.h, because an inline
// function there would be compiled for each instruction set, and the linker keeps one of them.
#pragma once

#include <cstddef>

#include "core/physics/linear.h"
#include "core/physics/solve/kernel.h"

namespace tessera::physics {

// An index that a block counts as int.
constexpr std::size_t At(int i) { return static_cast<std::size_t>(i); }

inline Vec3f Get(const float (&v)[4]) { return {v[0], v[1], v[2]}; }

inline void Add(float (&to)[4], Vec3f v) {
  to[0] += v.x;
  to[1] += v.y;
  to[2] += v.z;
}

inline SymMat3f RootInertia(const SolvedMass& mass) {
  const float(&r)[6] = mass.root_inertia;
  return {r[0], r[1], r[2], r[3], r[4], r[5]};
}

}  // namespace tessera::physics
