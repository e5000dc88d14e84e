// PredictedMotion: how a body moves in a step if nothing hinders it; zero while it sleeps.
#pragma once

#include "core/world/math.h"

namespace tessera::physics {

struct PredictedMotion {
  Vec3f move_m;        // displacement of the centre of mass
  Vec3f velocity_m_s;  // at the end of the step
  Vec3f spin_rad_s;    // angular velocity, constant over the step
  float sweep_m = 0;   // displacement of the fastest point against the centre
};

}  // namespace tessera::physics
