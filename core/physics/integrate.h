// Integration: bodies that nothing holds fly, and all that are awake are moved to the end of the step.
//
// Thread rule: one thread at a time, which leads the team.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/islands.h"
#include "core/physics/loads.h"
#include "core/physics/motion/body_motion.h"
#include "core/physics/rigid_body.h"
#include "core/physics/thread_team.h"

namespace tessera::physics {

// Where free flight takes a body in a step: the parabola, or its damped form, and exact rotation.
BodyMotion FreeFlightOf(const RigidBody& body, double dt_s);

// Writes the motions, by awake_index, of the bodies whose islands are not solved.
void FlyFree(std::span<RigidBody* const> awake, const Islands& islands, std::span<const IslandPlan> plans, double dt_s,
             std::span<BodyMotion> motions, ThreadTeam& team = ThreadTeam::Alone());

// Integrator: gives awake bodies the state at the end of their motion, and forgets the forces that made it.
class Integrator {
 public:
  explicit Integrator(ThreadTeam& team = ThreadTeam::Alone()) : team_(team) {}

  // An island with a motion that is not finite stays where it is, and its fastest body is given up: see `failing`. That
  // cannot happen while everything that comes in is sane.
  void Run(std::span<RigidBody* const> awake, const Islands& islands, std::span<const BodyMotion> motions);

  // Bodies that are to be taken out of the world, one of each island that failed, so that what is left can be solved.
  std::span<RigidBody* const> failing() const { return failing_; }

  // For assertions; linear in awake bodies.
  static bool Validate(std::span<RigidBody* const> awake);

 private:
  void FindFailing(std::span<RigidBody* const> awake, const Islands& islands);

  ThreadTeam& team_;
  std::vector<std::uint8_t> failed_;  // by island; empty unless one failed
  std::vector<RigidBody*> failing_;
};

}  // namespace tessera::physics
