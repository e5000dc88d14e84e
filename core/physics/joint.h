// Joint: a joint of a world and the bodies that it connects.
#pragma once

#include "core/physics/rigid_body.h"
#include "core/physics/solve/joint_model.h"

namespace tessera::physics {

struct Joint {
  JointId id;
  RigidBody* a = nullptr;
  RigidBody* b = nullptr;  // null for a joint to the world, which the model takes as its body a
  bool bodies_collide = false;
  JointModel model;  // AwakeJoints counts its turns, and the solve pass writes its impulses
  int substeps = 0;  // The solve pass writes the number of its last solve here, as impulses are those of one substep

  // One of its bodies that is awake; at least one is, in a joint that AwakeJoints lists.
  RigidBody& AwakeBody() const { return a->awake() ? *a : *b; }
  bool ConnectsAwakeBodies() const { return b != nullptr && a->awake() && b->awake(); }
};

// Whether a joint keeps the two from touching each other.
bool JointForbidsContact(const RigidBody& a, const RigidBody& b);

}  // namespace tessera::physics
