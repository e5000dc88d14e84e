// Penetration: the way out of a deep overlap, by Bullet's EPA.
//
// Thread rule: one thread at a time (Bullet keeps statics).
#pragma once

#include "core/physics/collide/convex.h"

namespace tessera::physics {

// From a to b, and a point between the two surfaces. False where EPA finds none, as it does for flat and degenerate
// shapes; it works in single precision and its answer is a good guess rather than the last word.
bool DeepestWay(const Core& a, const Core& b, Vec3d start, Vec3f* normal, Vec3f* middle);

}  // namespace tessera::physics
