// A cone whose surface lies exactly where it was given, with its origin at its centre of mass or anywhere on its axis.
#pragma once

#include <BulletCollision/CollisionShapes/btConvexInternalShape.h>

namespace tessera::physics {

// Along y, apex up. Bullet's own cone is larger than its dimensions by the collision margin and centred halfway up;
// this one holds an inner cone that is inset by the margin on all sides, so that margin and cone together fill the
// given one. The outer radius and height are kept for bounds.
ATTRIBUTE_ALIGNED16(class) ConeShapeBt : public btConvexInternalShape {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  // `base_y`: height of the base over the origin.
  ConeShapeBt(btScalar radius, btScalar height, btScalar base_y, btScalar margin);

  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override;
  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* vertices, int count)
      const override;
  void getAabb(const btTransform& transform, btVector3& aabb_min, btVector3& aabb_max) const override;
  void calculateLocalInertia(btScalar mass, btVector3 & inertia) const override;
  const char* getName() const override { return "Cone"; }

 private:
  btScalar inner_radius_, inner_base_y_, inner_apex_y_;
};

}  // namespace tessera::physics
