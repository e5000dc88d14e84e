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
  // Now and then: keeps the trees in shape.
  void Tend();

  // Two whose bounds overlap, at least one of them dynamic.
  struct Meeting {
    std::uint64_t key;  // as PairTable has it
    const btBroadphaseProxy *a, *b;
  };
  // Pairs that may have begun since they were last cleared; what is told may have been told before. Order means
  // nothing.
  std::vector<Meeting>& met() { return sink_.met; }
  static RigidBody& BodyOf(const btBroadphaseProxy& proxy);

  // Bodies whose fat bounds overlap these, appended.
  void Overlapping(const Bounds& bounds, std::vector<RigidBody*>* bodies);

  // For queries. Objects stand where `ShowToBullet` last put them.
  btCollisionWorld& bullet() { return world_; }

 private:
  // Bullet's tree reports overlaps to its pair cache.
  struct Sink : btNullPairCache {
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override;
    std::vector<Meeting> met;
  };

  Sink sink_;
  btDbvtBroadphase trees_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btCollisionWorld world_;
};

}  // namespace tessera::physics
