// Rotations by axis and angle, for the tests of this folder.
#pragma once

#include <cmath>

#include "core/world/math.h"

namespace tessera::physics {

// By `angle` (rad) about `axis`, of any length but 0.
inline Quatd About(Vec3d axis, double angle) {
  const Vec3d v = Normalized(axis) * std::sin(angle / 2);
  return {v.x, v.y, v.z, std::cos(angle / 2)};
}

}  // namespace tessera::physics
