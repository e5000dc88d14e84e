#include "core/physics/queries.h"

#include <algorithm>

#include "core/physics/bullet_math.h"
#include "core/physics/rigid_body.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

btDefaultCollisionConstructionInfo SmallPools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = kQueryPool;
  info.m_defaultMaxCollisionAlgorithmPoolSize = kQueryPool;
  return info;
}

void SortUnique(std::vector<BodyId>* ids) {
  std::sort(ids->begin(), ids->end());
  ids->erase(std::unique(ids->begin(), ids->end()), ids->end());
}

// Bullet asks `needsCollision` about every body whose bounds a query meets, before it looks at the body's shape.
RigidBody& WithBulletShape(const btBroadphaseProxy& proxy, BulletShapes& shapes) {
  RigidBody& body = BroadPhase::BodyOf(proxy);
  if (body.object.getCollisionShape() == nullptr) body.object.setCollisionShape(shapes.Of(body.shared_geometry()));
  return body;
}

// A trigger is no obstacle to a ray.
class NearestHit : public btCollisionWorld::ClosestRayResultCallback {
 public:
  NearestHit(const btVector3& from, const btVector3& to, BulletShapes& shapes)
      : ClosestRayResultCallback(from, to), shapes_(shapes) {}
  bool needsCollision(btBroadphaseProxy* proxy) const override { return !WithBulletShape(*proxy, shapes_).trigger(); }

 private:
  BulletShapes& shapes_;
};

// Bodies that have a point in common with the shape of the query.
class TouchingBodies : public btCollisionWorld::ContactResultCallback {
 public:
  TouchingBodies(const btCollisionObject* query, BulletShapes& shapes) : query_(query), shapes_(shapes) {}
  bool needsCollision(btBroadphaseProxy* proxy) const override {
    WithBulletShape(*proxy, shapes_);
    return true;
  }
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
  BulletShapes& shapes_;
};

}  // namespace

Queries::Queries(BroadPhase& broad_phase, Vec3d origin)
    : broad_phase_(broad_phase),
      origin_(origin),
      configuration_(SmallPools()),
      dispatcher_(&configuration_),
      world_(&dispatcher_, &broad_phase.trees(), &configuration_) {}

std::optional<RayHit> Queries::CastRay(Vec3d from, Vec3d to) {
  const btVector3 start = ToBullet(from - origin_), end = ToBullet(to - origin_);
  NearestHit nearest(start, end, shapes_);
  world_.rayTest(start, end, nearest);
  if (!nearest.hasHit()) return std::nullopt;
  const double fraction = nearest.m_closestHitFraction;
  return RayHit{.body = RigidBody::Of(*nearest.m_collisionObject).id(),
                .point = from + (to - from) * fraction,
                .normal = Normalized(FromBullet(nearest.m_hitNormalWorld)),
                .fraction = fraction};
}

std::vector<BodyId> Queries::Overlapping(const Shape& convex, const Pose& pose) {
  const std::shared_ptr<const Geometry> geometry = MakeGeometry(convex, {});
  const std::shared_ptr<btCollisionShape> shape = MakeBulletShape(*geometry);
  btCollisionObject query;
  query.setCollisionShape(shape.get());
  query.setWorldTransform(ToBullet(Pose{pose.position - origin_, pose.orientation}));
  TouchingBodies touching(&query, shapes_);
  world_.contactTest(&query, touching);
  SortUnique(&touching.ids);
  return touching.ids;
}

std::vector<BodyId> Queries::Overlapping(const Aabb& box) {
  const Bounds bounds{Vec3f(box.min - origin_), Vec3f(box.max - origin_)};
  std::vector<RigidBody*> near;
  broad_phase_.Overlapping(bounds, &near);
  std::vector<BodyId> ids;
  for (const RigidBody* body : near) {
    if (broad_phase_.TightBounds(*body).Overlaps(bounds)) ids.push_back(body->id());
  }
  SortUnique(&ids);
  return ids;
}

}  // namespace tessera::physics
