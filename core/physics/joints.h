// Joints: from a scene's joint to Bullet's constraint.
//
// Positions and velocities along a joint's axes are those of body_b against body_a, and the axes those of frame_a. In a
// joint to the world, the world takes the part of body_a: the axes are those of frame_b, and "turn at 2 rad/s" turns
// the body by +2.
#pragma once

#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>

#include <memory>
#include <vector>

#include "core/physics/body.h"

namespace tessera::physics {

class Joint {
 public:
  // `b` is null for the world, for which `world` stands: a static body at the origin of Bullet's coordinates, which is
  // `origin` in world space.
  Joint(const JointDef& def, Body& a, Body* b, btRigidBody& world, Vec3d origin);

  JointId id() const { return id_; }
  BodyId body_a() const { return body_a_; }
  BodyId body_b() const { return body_b_; }
  bool bodies_collide() const { return bodies_collide_; }
  btTypedConstraint& bullet() { return *constraint_; }

  // Before the first step and when the step changes. Bullet integrates springs explicitly, so one that is too stiff for
  // the step would blow up; it is held to one radian of its own oscillation a step.
  void Tune(double dt_s);

 private:
  struct Stiff {
    int axis;
    double stiffness, mass;  // N/m and kg, or N m/rad and kg m^2
  };

  JointId id_;
  BodyId body_a_, body_b_;
  bool bodies_collide_;
  std::unique_ptr<btTypedConstraint> constraint_;
  std::vector<Stiff> springs_;
};

}  // namespace tessera::physics
