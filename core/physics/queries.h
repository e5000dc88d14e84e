// Rays and overlaps, in Bullet's coordinates about `origin`.
#pragma once

#include <optional>
#include <vector>

#include "core/physics/world.h"

class btCollisionWorld;

namespace tessera::physics {

std::optional<RayHit> CastRay(const btCollisionWorld& world, Vec3d origin, Vec3d from, Vec3d to);
std::vector<BodyId> OverlappingShape(btCollisionWorld& world, Vec3d origin, const Shape& convex, const Pose& pose);
std::vector<BodyId> OverlappingBox(btCollisionWorld& world, Vec3d origin, const Aabb& box);

}  // namespace tessera::physics
