#include "core/physics/awake_joints.h"

#include <algorithm>

namespace tessera::physics {

// Looks at all joints or at all awake bodies, whichever are fewer.
void AwakeJoints::List(BodyStore& bodies) {
  joints_.clear();
  if (bodies.joints().size() <= bodies.awake().size()) {
    for (auto& [id, joint] : bodies.joints()) {
      if (joint.a->awake() || (joint.b != nullptr && joint.b->awake())) joints_.push_back(&joint);
    }
    return;
  }
  for (const RigidBody* body : bodies.awake()) {
    for (Joint* joint : body->joints) {
      if (&joint->AwakeBody() == body) joints_.push_back(joint);
    }
  }
  std::sort(joints_.begin(), joints_.end(), [](const Joint* a, const Joint* b) { return a->id < b->id; });
}

void AwakeJoints::Run(BodyStore& bodies) {
  List(bodies);
  if (rows_.size() < joints_.size()) rows_.resize(joints_.size());
  const Placement world;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    Joint& joint = *joints_[i];
    const Placement& a = joint.a->placement();
    if (joint.b != nullptr) {
      joint.model.MakeRows(a, joint.b->placement(), &rows_[i]);
    } else {
      joint.model.MakeRows(world, a, &rows_[i]);
    }
  }
}

bool AwakeJoints::Validate() const {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (i > 0 && !(joints_[i - 1]->id < joints_[i]->id)) return false;
    if (!joints_[i]->AwakeBody().awake()) return false;
  }
  return rows_.size() >= joints_.size();
}

}  // namespace tessera::physics
