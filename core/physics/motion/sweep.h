// Sweep: when in a step two moving, turning shapes first touch.
//
// Conservative advancement (Mirtich 1996; Redon, Kim, Lin, Manocha 2004 for the rotating bound): steps by distance over
// the fastest possible approach, so it never passes an impact and never reports a near miss.
#pragma once

#include <optional>

#include "core/physics/collide/collide.h"

namespace tessera::physics {

// A body's way through one step: straight, turning at a constant rate.
struct Way {
  const Geometry& geometry;
  Vec3d from, to;          // of the centre of mass, m
  Quatd orientation_from, orientation_to;
};

struct Impact {
  double fraction = 0;  // of the step, 0 to 1: where their distance falls to `target_m`
  Vec3f normal;         // from a to b at that moment, unit
};

// Nothing if they stay further apart than `target_m`, or if they are nearer at the start and do not come nearer still.
// Compounds, meshes, height fields and planes work on either side.
std::optional<Impact> FirstImpact(const Way& a, const Way& b, float target_m);

}  // namespace tessera::physics
