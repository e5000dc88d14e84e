// Collide: the manifolds of a pair of bodies.
//
// Everything is reckoned in the frame of one of the two bodies from positions in doubles, so the result is the same to
// the bit wherever in the world the pair is, and in whichever region. The pair's order is by id and given by the
// caller.
//
//   PairCache cache;                         // lives as long as the pair
//   Manifolds manifolds;         // from the last step; impulses of points that stay are carried over
//   Collide({geo_a, pose_a}, {geo_b, pose_b}, 0.02f, cache, manifolds);
//
// Thread rule: none shared but Bullet's own statics; one thread at a time.
#pragma once

#include <memory>
#include <vector>

#include "core/physics/collide/geometry.h"
#include "core/physics/collide/manifold.h"
#include "core/physics/collide/pair_functions.h"

namespace tessera::physics {

// Placement of a body's frame (centre of mass, principal axes).
struct Placement {
  Vec3d position;
  Quatd orientation;
  Mat3f rotation;  // same as `orientation`
};

struct Collidable {
  const Geometry& geometry;
  const Placement& placement;
};

// A pair's memory between steps: the relative pose of its last full search, the result in local coordinates, and the
// axis that separated them. Starts empty; belongs to one pair of geometries.
struct PairCache {
  bool searched = false;
  float reach_m = 0;  // how far apart the last search looked
  float apart_m = 0;  // nothing was found, and nothing is nearer than this; 0: not known
  LocalPose pose;     // at the last search
  ConvexCache convex;
  LocalManifold manifold;  // if the pair has just one; on_b from a's origin at the search, along b's axes
  struct Parts;            // for a compound, mesh or height field
  struct DeleteParts {
    void operator()(Parts* parts) const;
  };
  std::unique_ptr<Parts, DeleteParts> parts;
};

// Replaces `manifolds` by what there is now: points nearer than `speculative_m`, with the impulses of the old ones that
// stay, and totals of 0. While the two have hardly moved against each other since the last search (kReuseMove_m,
// kReuseTurn_rad), the old points are carried along instead of searched anew: the search looks a little further than it
// is asked to, so none is missed. Ask for about the same distance from step to step: asking for more searches anew.
void Collide(const Collidable& a, const Collidable& b, float speculative_m, PairCache& cache, Manifolds& manifolds);

// Whether a search of two such shapes reads or writes its cache. Some are searched as quickly as remembered.
bool Remembers(const Geometry& a, const Geometry& b);

}  // namespace tessera::physics
