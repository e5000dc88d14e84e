#include "core/physics/broad_phase.h"

#include "core/physics/bullet_math.h"
#include "core/physics/pair_table.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

btDefaultCollisionConstructionInfo SmallPools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = kQueryPool;
  info.m_defaultMaxCollisionAlgorithmPoolSize = kQueryPool;
  return info;
}

}  // namespace

btBroadphasePair* BroadPhase::Sink::addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) {
  const auto fixed = [](const btBroadphaseProxy& proxy) {
    return proxy.m_collisionFilterGroup == btBroadphaseProxy::StaticFilter;
  };
  if (fixed(*a) && fixed(*b)) return nullptr;
  const auto first = static_cast<std::uint32_t>(a->m_uniqueId), second = static_cast<std::uint32_t>(b->m_uniqueId);
  met.push_back({PairTable::KeyOf(first, second), a, b});
  return nullptr;
}

RigidBody& BroadPhase::BodyOf(const btBroadphaseProxy& proxy) {
  return RigidBody::Of(*static_cast<const btCollisionObject*>(proxy.m_clientObject));
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
  const int group = body.dynamic() ? btBroadphaseProxy::DefaultFilter : btBroadphaseProxy::StaticFilter;
  const std::size_t told = sink_.met.size();
  world_.addCollisionObject(&body.object, group, btBroadphaseProxy::AllFilter);
  sink_.met.resize(told);  // all is told anew by `Update`
  // By which pairs are named, so that one that is known is known by its proxies alone.
  body.object.getBroadphaseHandle()->m_uniqueId = static_cast<int>(body.serial);
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
