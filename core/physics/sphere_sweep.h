// SweepSphere: the first body that a sphere meets on a straight way, for movements that feel their surroundings.
//
// Bodies are found by the bounds that the broad phase holds, which contain every body that has not left its predicted
// motion since the last step; the way to each is tested as continuous collision tests it (motion/sweep.h).
// Thread rule: one thread at a time.
#pragma once

#include <optional>

#include "core/physics/broad_phase.h"
#include "core/physics/world.h"

namespace tessera::physics {

struct SphereWay {
  Vec3d from, to;  // of the centre, world space
  double radius_m = 0;
  BodyId ignored;
};

// `origin`: the world position of the broad phase's origin. The contract is that of World::SweepSphere.
std::optional<SphereHit> SweepSphere(BroadPhase& broad_phase, Vec3d origin, const SphereWay& way);

}  // namespace tessera::physics
