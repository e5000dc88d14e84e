#include "core/physics/queries.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include <algorithm>

#include "core/physics/bullet_math.h"
#include "core/physics/rigid_body.h"

namespace tessera::physics {
namespace {

void SortUnique(std::vector<BodyId>* ids) {
  std::sort(ids->begin(), ids->end());
  ids->erase(std::unique(ids->begin(), ids->end()), ids->end());
}

// A trigger is no obstacle to a ray.
class Nearest : public btCollisionWorld::ClosestRayResultCallback {
 public:
  using ClosestRayResultCallback::ClosestRayResultCallback;
  bool needsCollision(btBroadphaseProxy* proxy) const override {
    return !RigidBody::Of(*static_cast<btCollisionObject*>(proxy->m_clientObject)).trigger();
  }
};

// Bodies with a point in common with the query's.
class Inside : public btCollisionWorld::ContactResultCallback {
 public:
  explicit Inside(const btCollisionObject* query) : query_(query) {}
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                           const btCollisionObjectWrapper* b, int, int) override {
    if (point.getDistance() > 0) return 0;
    const btCollisionObject* other =
        a->getCollisionObject() == query_ ? b->getCollisionObject() : a->getCollisionObject();
    ids.push_back(RigidBody::Of(*other).id());
    return 0;
  }
  std::vector<BodyId> ids;

 private:
  const btCollisionObject* query_;
};

class InBounds : public btBroadphaseAabbCallback {
 public:
  InBounds(const btVector3& min, const btVector3& max) : min_(min), max_(max) {}
  bool process(const btBroadphaseProxy* proxy) override {
    const auto& object = *static_cast<const btCollisionObject*>(proxy->m_clientObject);
    btVector3 min, max;
    object.getCollisionShape()->getAabb(object.getWorldTransform(), min, max);
    const bool apart = min.x() > max_.x() || max.x() < min_.x() || min.y() > max_.y() || max.y() < min_.y() ||
                       min.z() > max_.z() || max.z() < min_.z();
    if (!apart) ids.push_back(RigidBody::Of(object).id());
    return true;
  }
  std::vector<BodyId> ids;

 private:
  btVector3 min_, max_;
};

}  // namespace

std::optional<RayHit> CastRay(const btCollisionWorld& world, Vec3d origin, Vec3d from, Vec3d to) {
  const btVector3 start = ToBullet(from - origin), end = ToBullet(to - origin);
  Nearest nearest(start, end);
  world.rayTest(start, end, nearest);
  if (!nearest.hasHit()) return std::nullopt;
  const double fraction = nearest.m_closestHitFraction;
  return RayHit{.body = RigidBody::Of(*nearest.m_collisionObject).id(),
                .point = from + (to - from) * fraction,
                .normal = Normalized(FromBullet(nearest.m_hitNormalWorld)),
                .fraction = fraction};
}

std::vector<BodyId> OverlappingShape(btCollisionWorld& world, Vec3d origin, const Shape& convex, const Pose& pose) {
  const std::shared_ptr<CollisionShape> shape = MakeShape(convex, {});
  btCollisionObject query;
  query.setCollisionShape(shape->bullet());
  query.setWorldTransform(ToBullet(Pose{pose.position - origin, pose.orientation}));
  Inside inside(&query);
  world.contactTest(&query, inside);
  SortUnique(&inside.ids);
  return inside.ids;
}

std::vector<BodyId> OverlappingBox(btCollisionWorld& world, Vec3d origin, const Aabb& box) {
  const btVector3 min = ToBullet(box.min - origin), max = ToBullet(box.max - origin);
  InBounds in_bounds(min, max);
  world.getBroadphase()->aabbTest(min, max, in_bounds);
  SortUnique(&in_bounds.ids);
  return in_bounds.ids;
}

}  // namespace tessera::physics
