// The pairs that have a form of their own: boxes and hulls by separating axes, spheres and capsules in closed form.
// All as pair_functions.h says; the simpler shape is b.
#pragma once

#include "core/physics/collide/pair_functions.h"

namespace tessera::physics {

// dispatch.cpp: whether a is the body in whose frame the two are searched.
bool InOrder(const Geometry& a, const Geometry& b);

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

// capsule_pair.cpp: b is a capsule.
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
