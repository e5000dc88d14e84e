#include "core/physics/broad_phase.h"

#include "core/physics/bullet_math.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

RigidBody& BodyOf(const btBroadphaseProxy& proxy) {
  return RigidBody::Of(*static_cast<const btCollisionObject*>(proxy.m_clientObject));
}

btDefaultCollisionConstructionInfo SmallPools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = kQueryPool;
  info.m_defaultMaxCollisionAlgorithmPoolSize = kQueryPool;
  return info;
}

}  // namespace

btBroadphasePair* BroadPhase::Sink::addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) {
  RigidBody &first = BodyOf(*a), &second = BodyOf(*b);
  if (first.dynamic() || second.dynamic()) begun.emplace_back(&first, &second);
  return nullptr;
}

BroadPhase::BroadPhase()
    : trees_(&sink_),
      configuration_(SmallPools()),
      dispatcher_(&configuration_),
      world_(&dispatcher_, &trees_, &configuration_) {
  // A share of each tree is rebuilt in every step: of what rests, none.
  trees_.m_fupdates = 0;
}

void BroadPhase::Add(RigidBody& body) {
  world_.addCollisionObject(&body.object);
  Update(body);
}

void BroadPhase::Remove(RigidBody& body) { world_.removeCollisionObject(&body.object); }

void BroadPhase::Update(RigidBody& body) {
  trees_.setAabbForceUpdate(body.object.getBroadphaseHandle(), ToBullet(body.fat.min), ToBullet(body.fat.max),
                            &dispatcher_);
}

void BroadPhase::Tend() { trees_.collide(&dispatcher_); }

void BroadPhase::Overlapping(const Bounds& bounds, std::vector<RigidBody*>* bodies) {
  struct Collect : btBroadphaseAabbCallback {
    bool process(const btBroadphaseProxy* proxy) override {
      bodies->push_back(&BodyOf(*proxy));
      return true;
    }
    std::vector<RigidBody*>* bodies = nullptr;
  } collect;
  collect.bodies = bodies;
  trees_.aabbTest(ToBullet(bounds.min), ToBullet(bounds.max), collect);
}

}  // namespace tessera::physics
