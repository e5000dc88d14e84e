// BodyStore: the bodies and joints of a world, and which of the bodies are awake.
//
// Promise: a body is in `awake` exactly while it is dynamic, not asleep and not isolated, and then its `awake_index` is
// its place there; a body and a joint that holds it name each other. Bodies and joints stay where they are in memory
// until they are removed.
//
// Thread rule: one thread at a time.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "core/physics/joint.h"
#include "core/physics/rigid_body.h"

namespace tessera::physics {

class BodyStore {
 public:
  using BodyMap = absl::flat_hash_map<BodyId, std::unique_ptr<RigidBody>>;

  // --- Bodies. Ids that are asked for exist.
  bool Has(BodyId id) const { return bodies_.contains(id); }
  RigidBody& At(BodyId id) const;
  RigidBody* Find(BodyId id) const;  // null if there is no such body
  const BodyMap& all() const { return bodies_; }
  // Takes a new body in, and gives it a serial. It is not in `awake` yet.
  RigidBody& Add(std::unique_ptr<RigidBody> body);
  // Forgets a body that no joint holds and that is not in `awake`.
  void Remove(RigidBody& body);

  // --- Awake bodies, in no order.
  std::span<RigidBody* const> awake() const { return awake_; }
  void ListAwake(RigidBody& body);
  void UnlistAwake(RigidBody& body);

  // --- Kinematic bodies, ascending by id.
  std::span<RigidBody* const> kinematic() const { return kinematic_; }
  // Those of them that are under way; valid until the next call.
  std::span<RigidBody* const> Moving();

  // --- Joints.
  bool HasJoint(JointId id) const { return joints_.contains(id); }
  std::map<JointId, Joint>& joints() { return joints_; }
  Joint& JointAt(JointId id);
  Joint& AddJoint(const JointDef& def);
  void RemoveJoint(Joint& joint);

  // For assertions; linear in awake bodies and their joints.
  bool Validate() const;

 private:
  BodyMap bodies_;
  std::map<JointId, Joint> joints_;
  std::vector<RigidBody*> awake_, kinematic_, moving_;
  std::uint64_t next_serial_ = 1;
  std::vector<std::uint64_t> free_serials_;
};

}  // namespace tessera::physics
