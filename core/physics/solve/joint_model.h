// JointModel: a scene's joint, ready to be asked for its rows each step.
//
// Positions and velocities along a joint's axes are those of body_b against body_a, and the axes those of frame_a. In a
// joint to the world, the world takes the part of body_a: "turn at 2 rad/s" turns the body by +2.
#pragma once

#include <array>

#include "core/physics/collide/collide.h"
#include "core/physics/solve/rows.h"
#include "core/world/scene.h"

namespace tessera::physics {

class JointModel {
 public:
  // Frames are in the coordinates of the bodies (centre of mass, principal axes); `frame_a` of a joint to the world is
  // in world space, and its placement the identity.
  JointModel(const JointDef& def, const Pose& frame_a, const Pose& frame_b);

  // Rows at these placements. Angles of more than a turn are counted on: `StateOf` what a hinge has turned so far.
  void MakeRows(const Placement& a, const Placement& b, JointRows* rows);

  // Impulses of the last substep by slot, N s or N m s: what the next step starts with.
  std::array<float, kJointSlots> impulses{};

 private:
  JointDef def_;
  Pose frame_a_, frame_b_;
};

}  // namespace tessera::physics
