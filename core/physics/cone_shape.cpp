#include "core/physics/cone_shape.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>

#include <cmath>

namespace tessera::physics {

ConeShapeBt::ConeShapeBt(btScalar radius, btScalar height, btScalar base_y, btScalar margin) {
  m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;
  setMargin(margin);
  // Inset by m, the side moves down its axis by m / sin(half angle): the inner cone is similar to the outer one.
  const btScalar apex_drop = margin * std::sqrt(radius * radius + height * height) / radius;
  inner_base_y_ = base_y + margin;
  inner_apex_y_ = base_y + height - apex_drop;
  inner_radius_ = radius * (inner_apex_y_ - inner_base_y_) / height;
  m_implicitShapeDimensions.setValue(radius, height, radius);
}

btVector3 ConeShapeBt::localGetSupportingVertexWithoutMargin(const btVector3& direction) const {
  const btScalar across = std::sqrt(direction.x() * direction.x() + direction.z() * direction.z());
  const btScalar apex = direction.y() * inner_apex_y_;
  const btScalar rim = direction.y() * inner_base_y_ + across * inner_radius_;
  if (apex > rim) return {0, inner_apex_y_, 0};
  if (across <= SIMD_EPSILON) return {inner_radius_, inner_base_y_, 0};
  const btScalar scale = inner_radius_ / across;
  return {direction.x() * scale, inner_base_y_, direction.z() * scale};
}

void ConeShapeBt::batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* vertices,
                                                                    int count) const {
  for (int i = 0; i < count; ++i) vertices[i] = localGetSupportingVertexWithoutMargin(directions[i]);
}

void ConeShapeBt::getAabb(const btTransform& transform, btVector3& aabb_min, btVector3& aabb_max) const {
  const btMatrix3x3& basis = transform.getBasis();
  const btVector3 margin(getMargin(), getMargin(), getMargin());
  for (int i = 0; i < 3; ++i) {
    const btVector3 axis = basis.getRow(i);
    aabb_max[i] = axis.dot(localGetSupportingVertexWithoutMargin(axis));
    aabb_min[i] = axis.dot(localGetSupportingVertexWithoutMargin(-axis));
  }
  aabb_max += transform.getOrigin() + margin;
  aabb_min += transform.getOrigin() - margin;
}

void ConeShapeBt::calculateLocalInertia(btScalar, btVector3& inertia) const { inertia.setZero(); }

}  // namespace tessera::physics
