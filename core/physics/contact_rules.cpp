#include "core/physics/contact_rules.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btInternalEdgeUtility.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btCollisionShape.h>

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

// Bullet's adjustment turns the normal and leaves point and distance: a rolling ball would then have a contact ahead of
// its lowest point, to which its surface comes down. So the point moves round the shape's rounding (a ball's or
// capsule's radius, or a collision margin) by as much as the normal turned, and the distance is measured anew from the
// point on the triangle.
bool SmoothEdge(btManifoldPoint& point, const btCollisionObjectWrapper* a, int part_a, int triangle_a,
                const btCollisionObjectWrapper* b, int part_b, int triangle_b) {
  const btVector3 normal = point.m_normalWorldOnB, on_triangle = point.getPositionWorldOnB();
  btAdjustInternalEdgeContacts(point, a, b, part_a, triangle_a);  // each does nothing unless the first is a triangle
  btAdjustInternalEdgeContacts(point, b, a, part_b, triangle_b);
  if (point.m_normalWorldOnB == normal) return true;
  // Bullet's manifolds name the convex body first.
  const bool a_is_surface = a->getCollisionObject()->getCollisionShape()->isConcave();
  const btCollisionObjectWrapper &surface = a_is_surface ? *a : *b, &convex = a_is_surface ? *b : *a;
  point.m_positionWorldOnA += (normal - point.m_normalWorldOnB) * convex.getCollisionShape()->getMargin();
  point.setDistance((point.m_positionWorldOnA - on_triangle).dot(point.m_normalWorldOnB));
  point.m_positionWorldOnB = point.m_positionWorldOnA - point.m_normalWorldOnB * point.getDistance();
  point.m_localPointA = convex.getCollisionObject()->getWorldTransform().invXform(point.m_positionWorldOnA);
  point.m_localPointB = surface.getCollisionObject()->getWorldTransform().invXform(point.m_positionWorldOnB);
  return true;
}

}  // namespace

void InstallContactRules() {
  static std::once_flag once;
  std::call_once(once, [] {
    gCalculateCombinedFrictionCallback = &Friction;
    gCalculateCombinedRestitutionCallback = &Restitution;
    gCalculateCombinedRollingFrictionCallback = &RollingFriction;
    gCalculateCombinedSpinningFrictionCallback = &SpinningFriction;
    gContactAddedCallback = &SmoothEdge;
  });
}

}  // namespace tessera::physics
