// Spared sweeps: what tells without a sweep that two bodies did not pass through each other unseen.
//
// Pure functions, any thread.
#pragma once

#include <span>

#include "core/physics/motion/body_motion.h"
#include "core/physics/pair_table.h"
#include "core/physics/rigid_body.h"

namespace tessera::physics {

// A body's way through a step, as far as these tests ask.
struct Moved {
  Vec3d from, move;       // the centre of mass, m
  double rim_m = 0;       // its turning brings no point further than this
  double outer_radius_m;  // about the centre of mass; infinite for a plane
};
// `motions`: by awake_index.
Moved MovedOf(const RigidBody& body, std::span<const BodyMotion> motions);

// True if the balls about them that hold them stay apart: then a sweep finds no impact.
bool StayApart(const Moved& low, const Moved& high);

// Whether a pair that was solved needs a sweep all the same, because it gave way: a rod that is stopped at its end
// turns about it, and most of it would be behind the wall by the end of the step.
bool GoesThrough(const Pair& pair, const Moved& low, const Moved& high, std::span<const BodyMotion> motions);

}  // namespace tessera::physics
