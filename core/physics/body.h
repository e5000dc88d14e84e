// Body: what the world knows of one rigid body, and the passage of its state in and out of Bullet.
#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <memory>
#include <vector>

#include "core/physics/shapes.h"
#include "core/world/scene.h"

namespace tessera::physics {

// Its state is kept as it goes out, and Bullet's transform is always the one that this state gives: what one world
// reads out and another sets has the same bits in both. So after each step the orientation passes through a quaternion
// once.
class Body {
 public:
  // `origin`: of Bullet's coordinates in world space. `gravity` as for a gravity scale of 1.
  Body(const BodyDef& def, BodyForm form, const BodyState& state, Vec3d origin, Vec3d gravity);

  BodyId id() const { return id_; }
  btRigidBody& bullet() { return *bullet_; }
  const btRigidBody& bullet() const { return *bullet_; }
  const BodyState& state() const { return state_; }
  bool dynamic() const { return dynamic_; }
  bool trigger() const { return trigger_; }
  bool asleep() const { return state_.asleep; }
  double mass_kg() const { return mass_kg_; }
  Vec3d inertia() const { return form_.inertia; }
  // From the coordinates of the body's shape, which joint frames are in, to Bullet's.
  btTransform LocalFrame(const Pose& in_shape) const;

  // What a new state would be to the body. A sleeper that is told to creep by less than what it may sleep with takes
  // the new state in silence: the two sides of a border fall asleep a tick or two apart, and must not wake each other
  // by that.
  enum class Change { kNone, kSilent, kMoves };
  Change Compare(const BodyState& state) const;
  // Takes over a state; sleeps if it says so. A silent change leaves a sleeper asleep.
  void Set(const BodyState& state, Vec3d origin);
  // After a step: reads what Bullet did.
  void Publish(Vec3d origin);
  // After an impulse: reads the velocities alone.
  void PublishVelocity();
  void Wake();

  static Body& Of(const btCollisionObject& object) { return *static_cast<Body*>(object.getUserPointer()); }

  std::vector<JointId> joints;  // that hold it, in no order
  int node = 0;                 // scratch of the island search

 private:
  Quatd OutwardOrientation(const btQuaternion& inner) const;
  void PlacePlane(Vec3d origin);
  void NoteRest();
  btTransform InnerTransform(Vec3d origin) const;

  BodyId id_;
  bool dynamic_, trigger_, may_sleep_;
  double mass_kg_;
  ShapePtr scene_shape_;
  BodyForm form_;
  BodyState state_;
  Vec3d rest_position_;  // where and how it lay when it fell asleep
  Quatd rest_orientation_;
  std::unique_ptr<btRigidBody> bullet_;
};

}  // namespace tessera::physics
