#include "core/physics/materials.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <cmath>
#include <mutex>

namespace tessera::physics {
namespace {

btScalar Friction(const btCollisionObject* a, const btCollisionObject* b) {
  return std::sqrt(a->getFriction() * b->getFriction());
}

btScalar Restitution(const btCollisionObject* a, const btCollisionObject* b) {
  return std::max(a->getRestitution(), b->getRestitution());
}

btScalar SpinningFriction(const btCollisionObject* a, const btCollisionObject* b) {
  return std::max(a->getSpinningFriction(), b->getSpinningFriction());
}

btScalar RollingFriction(const btCollisionObject* a, const btCollisionObject* b) {
  // The solver skips spinning friction where there is no rolling friction, so a spinning pair gets a trace of it.
  constexpr btScalar kTrace = 1e-9f;
  const btScalar rolling = std::max(a->getRollingFriction(), b->getRollingFriction());
  return SpinningFriction(a, b) > 0 ? std::max(rolling, kTrace) : rolling;
}

}  // namespace

void InstallMaterialRules() {
  static std::once_flag once;
  std::call_once(once, [] {
    gCalculateCombinedFrictionCallback = &Friction;
    gCalculateCombinedRestitutionCallback = &Restitution;
    gCalculateCombinedRollingFrictionCallback = &RollingFriction;
    gCalculateCombinedSpinningFrictionCallback = &SpinningFriction;
  });
}

}  // namespace tessera::physics
