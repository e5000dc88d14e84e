// Gjk: the nearest points of two convex cores, in doubles.
//
// Gilbert, Johnson, Keerthi 1988, with Ericson's nearest points of a simplex (Real-Time Collision Detection, 5.1 and
// 9.5). It starts from a direction that is given and keeps nothing: the same cores give the same bits. Bullet's own
// works in float and takes points within 1 cm for the same, which is too coarse for small shapes and for the distances
// that contacts are measured by.
//
// Thread rule: free functions; any thread.
#pragma once

#include "core/physics/collide/convex.h"

namespace tessera::physics {

struct GjkResult {
  enum class Kind { kApart, kFar, kOverlap };
  Kind kind = Kind::kOverlap;  // kFar: further apart than asked for; points are not found
  Vec3d on_a, on_b;            // nearest points of the cores
  double distance_m = 0;       // between the cores; kFar: at least this
  Vec3d axis;                  // from a to b, unit, where they are apart
};

// Looks up to `within_m`. `start`: roughly from a to b; any vector will do. Where the axis alone counts, an error of
// `close_enough_m` in the distance saves half of the steps on round shapes.
GjkResult Gjk(const Core& a, const Core& b, Vec3d start, double within_m, double close_enough_m = 0);

}  // namespace tessera::physics
