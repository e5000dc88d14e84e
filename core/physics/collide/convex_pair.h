// The way between two convex shapes, and the manifold across it: what `CollideConvexPair` and triangles share.
//
// Thread rule: free functions; one thread at a time (Bullet's EPA).
#pragma once

#include "core/physics/collide/convex.h"
#include "core/physics/collide/support_face.h"

namespace tessera::physics {

struct Gap {
  Vec3f normal;            // unit, from a to b
  float separation_m = 0;  // between the true surfaces, along the axis
  Vec3f middle;            // between the nearest points, or the deepest
  bool exact = false;      // not guessed from cores or by EPA
};

// min over b - max over a of dot(normal, p): how far apart along `normal`, which is the distance if it is the nearest
// way.
float SeparationAlong(const Convex& a, const Convex& b, Vec3f normal);

// The shortest way between the two, or out of each other where they overlap. Apart it is exact; overlapping by less
// than the insets of `Core` it is that of the cores; deeper, Bullet's EPA. False if they are farther apart than
// `speculative_m`; `gap->separation_m` is then a lower bound of how far.
bool FindGap(const Convex& a, const Convex& b, float speculative_m, Gap* gap);

// Points where the faces or edges that look at each other along `gap.normal` overlap; the nearest point alone where
// nothing does.
void MakeManifold(const Convex& a, const Convex& b, const Gap& gap, float speculative_m, LocalManifold* out);

// `shape`, of a, is a segment or point over a face of b: its ends, cut to the prism over the face. False if none is
// there.
bool CollideOnFace(const FaceView& face, const SupportFace& shape, float speculative_m, LocalManifold* out);

}  // namespace tessera::physics
