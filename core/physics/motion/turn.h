// Turned: an orientation after a rotation vector.
#pragma once

#include "core/physics/trig.h"

namespace tessera::physics {

// `turn`: axis times angle, world axes, rad.
inline Quatd Turned(Quatd orientation, Vec3d turn) {
  if (turn == Vec3d()) return orientation;
  return Normalized(TurnBy(turn) * orientation);
}

}  // namespace tessera::physics
