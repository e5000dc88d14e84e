// Queries: rays and overlaps with the bodies of a world, answered by Bullet.
//
//   Queries queries(broad_phase, origin);
//   std::optional<RayHit> hit = queries.CastRay(from, to);
//
// Bodies count as standing where `RigidBody::ShowToBullet` last put them, and are found by their bounds in the broad
// phase. A body gets a Bullet shape when a ray or a shape first comes near its bounds.
// Thread rule: one thread at a time.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>

#include <optional>
#include <vector>

#include "core/physics/broad_phase.h"
#include "core/physics/bullet_shapes.h"
#include "core/physics/world.h"

namespace tessera::physics {

class Queries {
 public:
  // `broad_phase` outlives it. `origin`: the world position of the broad phase's origin.
  Queries(BroadPhase& broad_phase, Vec3d origin);
  Queries(const Queries&) = delete;
  Queries& operator=(const Queries&) = delete;

  // The contracts are those of World's methods of the same names.
  std::optional<RayHit> CastRay(Vec3d from, Vec3d to);
  std::vector<BodyId> Overlapping(const Shape& convex, const Pose& pose);
  std::vector<BodyId> Overlapping(const Aabb& box);

 private:
  BroadPhase& broad_phase_;
  Vec3d origin_;
  BulletShapes shapes_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btCollisionWorld world_;  // holds no bodies: it finds them through the broad phase
};

}  // namespace tessera::physics
