#include "core/physics/joint.h"

#include <algorithm>

namespace tessera::physics {

bool JointForbidsContact(const RigidBody& a, const RigidBody& b) {
  return std::any_of(a.joints.begin(), a.joints.end(),
                     [&](const Joint* joint) { return !joint->bodies_collide && (joint->a == &b || joint->b == &b); });
}

}  // namespace tessera::physics
