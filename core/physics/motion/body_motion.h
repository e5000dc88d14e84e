// BodyMotion: where a body is at the end of a step, before it is moved there.
#pragma once

#include "core/world/math.h"

namespace tessera::physics {

struct BodyMotion {
  Vec3d position;          // centre of mass, m
  Quatd orientation;       // turns the principal axes
  Vec3f velocity;          // m/s
  Vec3f angular_momentum;  // world axes, kg m^2/s
  Vec3f turned_rad;        // rotation vector of the whole step, world axes
};

}  // namespace tessera::physics
