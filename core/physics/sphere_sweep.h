// SweepSphere: the first body that a sphere meets on a straight way, for movements that feel their surroundings.
//
// The way to each body is tested as continuous collision tests it (motion/sweep.h). Thread rule: free functions on
// values.
#pragma once

#include <optional>
#include <span>

#include "core/physics/rigid_body.h"
#include "core/physics/world.h"

namespace tessera::physics {

struct SphereWay {
  Vec3d from, to;  // the centre's way, world space
  double radius_m = 0;
  BodyId ignored;
  CollisionLayer layer;  // layer of the moving body: layers that ignore it are no obstacle
};

// Nothing outside of these bounds can be met on the way.
Aabb BoundsOf(const SphereWay& way);

// `near`: all bodies within these bounds, in any order. The contract is that of World::SweepSphere.
std::optional<SphereHit> SweepSphere(std::span<const RigidBody* const> near, const SphereWay& way);

}  // namespace tessera::physics
