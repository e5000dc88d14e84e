// Stops: which bodies a sweep stopped, where on their way, and at what.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/motion/body_motion.h"
#include "core/physics/motion/sweep.h"
#include "core/physics/rigid_body.h"

namespace tessera::physics {

// A body comes upon another within the step.
struct Stop {
  std::uint32_t index;  // awake_index
  double share;         // share of its motion after which the two meet
  RigidBody* by;        // the other body
  // Where the motion would have ended, and at which velocity; known once the body is moved back.
  Vec3d end_m{};
  Vec3f velocity_m_s{};
};

// Whether a body continues, and takes the other along, where the two meet: a much heavier one does, or a ship would
// stop in its course, with all that stands in it, for a ball that bounces within. A jointed body is not taken along,
// for it would have to be with all that hangs on it.
bool Carries(const RigidBody& body, const RigidBody& other);

// Sorts stops by the ids of their bodies, for the order in which bodies are listed is no part of a world's state, and
// keeps of each body the first stop on its way. A body that would have been carried by another, but is stopped by
// something else before, stops that other one like any body does.
void SortStops(std::span<RigidBody* const> awake, std::vector<Stop>* stops);

// Motion of a body through the step; a body that is not awake stays.
SweptMotion SweptMotionOf(const RigidBody& body, std::span<const BodyMotion> motions);

// Moves bodies back to where they were stopped, and notes in the stops where they would have ended.
void MoveBack(std::span<RigidBody* const> awake, std::span<Stop> stops, std::span<BodyMotion> motions);

}  // namespace tessera::physics
