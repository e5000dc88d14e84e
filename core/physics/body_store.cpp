#include "core/physics/body_store.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <utility>

namespace tessera::physics {

RigidBody& BodyStore::At(BodyId id) const {
  const auto it = bodies_.find(id);
  assert(it != bodies_.end() && "no such body");
  return *it->second;
}

RigidBody* BodyStore::Find(BodyId id) const {
  const auto it = bodies_.find(id);
  return it != bodies_.end() ? it->second.get() : nullptr;
}

RigidBody& BodyStore::Add(std::unique_ptr<RigidBody> body) {
  RigidBody& added = *body;
  if (free_serials_.empty()) free_serials_.push_back(next_serial_++);
  added.serial = free_serials_.back();
  free_serials_.pop_back();
  bodies_.emplace(added.id(), std::move(body));
  if (added.kinematic()) {
    kinematic_.insert(std::ranges::upper_bound(kinematic_, added.id(), {}, &RigidBody::id), &added);
  }
  return added;
}

void BodyStore::Remove(RigidBody& body) {
  assert(body.joints.empty() && body.pairs.empty());
  free_serials_.push_back(body.serial);
  if (body.kinematic()) std::erase(kinematic_, &body);
  bodies_.erase(body.id());
}

std::span<RigidBody* const> BodyStore::Moving() {
  moving_.clear();
  std::ranges::copy_if(kinematic_, std::back_inserter(moving_), &RigidBody::moving);
  return moving_;
}

void BodyStore::ListAwake(RigidBody& body) {
  body.awake_index = static_cast<std::uint32_t>(awake_.size());
  awake_.push_back(&body);
}

void BodyStore::UnlistAwake(RigidBody& body) {
  awake_.back()->awake_index = body.awake_index;
  awake_[body.awake_index] = awake_.back();
  awake_.pop_back();
}

Joint& BodyStore::JointAt(JointId id) {
  const auto it = joints_.find(id);
  assert(it != joints_.end() && "no such joint");
  return it->second;
}

// The model of a joint to the world takes the world as its body a, so the body is the model's b and its frame comes
// second.
Joint& BodyStore::AddJoint(const JointDef& def) {
  RigidBody& a = At(def.body_a);
  RigidBody* b = def.body_b == BodyId() ? nullptr : &At(def.body_b);
  const Pose frame_a = a.LocalFrame(def.frame_a);
  Joint joint{.id = def.id,
              .a = &a,
              .b = b,
              .bodies_collide = def.bodies_collide,
              .model = b != nullptr ? JointModel(def, frame_a, b->LocalFrame(def.frame_b))
                                    : JointModel(def, def.frame_b, frame_a)};
  Joint& added = joints_.emplace(def.id, joint).first->second;
  for (RigidBody* body : {&a, b}) {
    if (body != nullptr) body->joints.push_back(&added);
  }
  return added;
}

void BodyStore::RemoveJoint(Joint& joint) {
  for (RigidBody* body : {joint.a, joint.b}) {
    if (body != nullptr) std::erase(body->joints, &joint);
  }
  joints_.erase(joint.id);
}

bool BodyStore::Validate() const {
  for (std::size_t i = 0; i < awake_.size(); ++i) {
    const RigidBody& body = *awake_[i];
    if (body.awake_index != i || !body.awake() || body.isolated) return false;
    for (const Joint* joint : body.joints) {
      if (joint->a != &body && joint->b != &body) return false;
    }
  }
  return true;
}

}  // namespace tessera::physics
