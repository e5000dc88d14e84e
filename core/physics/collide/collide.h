// Collide: the manifolds of a pair of bodies.
//
// Everything is reckoned in the frame of one of the two bodies from positions in doubles, so the result is the same to
// the bit wherever in the world the pair is, and in whichever region. The pair's order is by id and given by the caller.
//
//   PairCache cache;                         // lives as long as the pair
//   std::vector<Manifold> manifolds;         // of the last step; impulses of points that stay are carried over
//   Collide({geo_a, pose_a}, {geo_b, pose_b}, 0.02f, cache, manifolds);
//
// Thread rule: none shared but Bullet's own statics; one thread at a time.
#pragma once

#include <vector>

#include "core/physics/collide/geometry.h"
#include "core/physics/collide/manifold.h"

namespace tessera::physics {

// Of a body's frame (centre of mass, principal axes).
struct Placement {
  Vec3d position;
  Quatd orientation;
  Mat3f rotation;  // of `orientation`
};

struct Collidable {
  const Geometry& geometry;
  const Placement& placement;
};

// What a pair remembers between steps: the relative pose of its last full search, what it found in local coordinates, and
// the axis that told them apart.
struct PairCache;

// Replaces `manifolds` by what there is now: points nearer than `speculative_m`. While the two have hardly moved against
// each other since the last search (kReuseMove_m, kReuseTurn_rad), the old points are carried along instead of searched anew.
void Collide(const Collidable& a, const Collidable& b, float speculative_m, PairCache& cache,
             std::vector<Manifold>& manifolds);

}  // namespace tessera::physics
