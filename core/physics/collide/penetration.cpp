#include "core/physics/collide/penetration.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletCollision/CollisionShapes/btConvexInternalShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include <cmath>

#include "core/physics/bullet_math.h"

namespace tessera::physics {
namespace {

// A core with its rounding, as Bullet sees shapes. It lies in the pair's frame already.
ATTRIBUTE_ALIGNED16(class) ForBullet : public btConvexInternalShape {
 public:
  // `origin` is subtracted, to keep what float sees small.
  ForBullet(const Core& core, Vec3d origin) : core_(core), origin_(origin) {
    m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;
    m_collisionMargin = 0;
  }

  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override {
    Vec3d d{direction.x(), direction.y(), direction.z()};
    const double length = Length(d);
    d = length > 0 ? d / length : Vec3d{1, 0, 0};
    return ToBullet(core_.Support(d) + d * core_.radius() - origin_);
  }
  btVector3 localGetSupportingVertex(const btVector3& direction) const override {
    return localGetSupportingVertexWithoutMargin(direction);
  }
  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* vertices, int count)
      const override {
    for (int i = 0; i < count; ++i) vertices[i] = localGetSupportingVertexWithoutMargin(directions[i]);
  }
  void calculateLocalInertia(btScalar, btVector3 & inertia) const override { inertia.setZero(); }
  const char* getName() const override { return "Core"; }

 private:
  const Core& core_;
  Vec3d origin_;
};

}  // namespace

bool DeepestWay(const Core& a, const Core& b, Vec3d start, Vec3f* normal, Vec3f* middle) {
  const Vec3d origin = a.Support(start);
  const ForBullet shape_a(a, origin), shape_b(b, origin);
  const btTransform& here = btTransform::getIdentity();
  btGjkEpaSolver2::sResults result;
  if (!btGjkEpaSolver2::Penetration(&shape_a, here, &shape_b, here, ToBullet(start), result)) return false;
  const Vec3f way = FromBullet(result.normal);
  const float length = Length(way);
  if (!(length > 0.5f) || !std::isfinite(length)) return false;
  *normal = way / -length;
  *middle = Vec3f(origin) + (FromBullet(result.witnesses[0]) + FromBullet(result.witnesses[1])) * 0.5f;
  return IsFinite(*middle);
}

}  // namespace tessera::physics
