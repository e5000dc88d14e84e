// BroadPhase: which bodies' bounds overlap. Bullet's pair of dynamic trees, over a pair table of ours.
//
// Bullet asks a cache to keep every pair and walks all of it in each step; here a pair is told once, when it begins,
// and what becomes of it is the world's business. So a body that sleeps costs nothing.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>

#include <utility>
#include <vector>

#include "core/physics/rigid_body.h"

namespace tessera::physics {

class BroadPhase {
 public:
  BroadPhase();
  BroadPhase(const BroadPhase&) = delete;
  BroadPhase& operator=(const BroadPhase&) = delete;

  // `body.fat` says where.
  void Add(RigidBody& body);
  void Remove(RigidBody& body);
  // Tells the trees of a new `body.fat`.
  void Update(RigidBody& body);
  // Once a step: keeps the trees in shape.
  void Tend();

  // Pairs that began since the last call, at least one of each dynamic; one may be told twice. Order means nothing.
  std::vector<std::pair<RigidBody*, RigidBody*>>& begun() { return sink_.begun; }

  // Bodies whose fat bounds overlap these, appended.
  void Overlapping(const Bounds& bounds, std::vector<RigidBody*>* bodies);

  // For queries. Objects stand where `ShowToBullet` last put them.
  btCollisionWorld& bullet() { return world_; }

 private:
  // Bullet's tree reports overlaps to its pair cache.
  struct Sink : btNullPairCache {
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override;
    std::vector<std::pair<RigidBody*, RigidBody*>> begun;
  };

  Sink sink_;
  btDbvtBroadphase trees_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btCollisionWorld world_;
};

}  // namespace tessera::physics
