// The pairs that have a form of their own: boxes and hulls by separating axes, spheres and capsules in closed form.
// All as pair_functions.h says; the simpler shape is b.
#pragma once

#include "core/physics/collide/pair_functions.h"

namespace tessera::physics {

// dispatch.cpp: whether a is the body in whose frame the two are searched.
bool InOrder(const Geometry& a, const Geometry& b);

// Separation of the nearest point; a large number where there is none.
inline float Nearest(const LocalManifold& manifold) {
  float nearest = 1e30f;
  for (int i = 0; i < manifold.count; ++i) {
    const float separation = manifold.points[static_cast<std::size_t>(i)].separation_m;
    if (separation < nearest) nearest = separation;
  }
  return nearest;
}

// box_box.cpp
void CollideBoxes(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                  ConvexCache& cache, LocalManifold* out);

// sphere_pair.cpp: b is a sphere.
void CollideSpheres(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                    LocalManifold* out);
void CollideCapsuleSphere(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                          LocalManifold* out);
void CollideBoxSphere(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                      LocalManifold* out);
void CollideHullSphere(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                       LocalManifold* out);

// capsule_pair.cpp, box_capsule.cpp: b is a capsule.
void CollideCapsules(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                     LocalManifold* out);
void CollideBoxCapsule(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                       LocalManifold* out);
void CollideHullCapsule(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                        LocalManifold* out);

// hull_pair.cpp: boxes and hulls.
void CollideHulls(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                  ConvexCache& cache, LocalManifold* out);

}  // namespace tessera::physics
