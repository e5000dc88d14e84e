// BulletShapes: geometries as Bullet sees them, for rays and overlaps.
//
// Contacts and sweeps use `Geometry` alone. A Bullet shape is made when a query first asks for it, so a world that asks
// nothing has none.
// Thread rule: one thread at a time.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <memory>

#include "core/physics/collide/geometry.h"
#include "core/physics/weak_cache.h"

namespace tessera::physics {

// The shape of `geometry` in the same frame. A mesh or a height field stays in the geometry, which must outlive it.
std::shared_ptr<btCollisionShape> MakeBulletShape(const Geometry& geometry);

class BulletShapes {
 public:
  // One shape for each geometry, kept for as long as the geometry lives.
  btCollisionShape* Of(const std::shared_ptr<const Geometry>& geometry) {
    return made_.Of(geometry, [&] { return MakeBulletShape(*geometry); }).get();
  }
  std::size_t size() const { return made_.size(); }

 private:
  WeakCache<const Geometry, std::shared_ptr<btCollisionShape>> made_;
};

}  // namespace tessera::physics
