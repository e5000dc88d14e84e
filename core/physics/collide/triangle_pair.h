// TrianglePair: one triangle of a surface against a convex shape.
//
// A contact's normal is that of the triangle, or one that an edge or corner really has: between the normals of the
// faces that meet there. So nothing is felt at edges inside a flat or hollow surface.
//
// Thread rule: free functions; one thread at a time (Bullet's EPA).
#pragma once

#include "core/physics/collide/convex_pair.h"
#include "core/physics/collide/surface.h"

namespace tessera::physics {

struct TrianglePlace {
  const Surface& surface;
  const LocalPose& pose;  // the surface in the convex shape's frame
  std::uint32_t index;
  std::array<Vec3f, 3> corners;  // in the convex shape's frame
  Vec3f normal;                  // unit, or 0 where the triangle has no extent

  TrianglePlace(const Surface& surface_in, const LocalPose& pose_in, std::uint32_t index_in);
  Vec3f In(Vec3d p) const { return pose.rotation * Vec3f(p - pose.a_in_b); }
};

enum class TriangleContact : std::uint8_t {
  kNone,
  kFront,
  // The shape's centre is behind: worth something only if the surface is touched nowhere else.
  kDeep,  // on its way out in front
  kBack,  // met from behind
};

// `convex` lies at the origin of the frame of `place`. `was_in_front`: of the surface, at the last search.
TriangleContact CollideTriangle(const Geometry& convex, const TrianglePlace& place, float speculative_m,
                                bool was_in_front, LocalManifold* out);

// The way out in front of a shape that was in front of a sheet before and has come to lie behind it altogether, by up
// to twice its size: too fast for contacts, too thin for sweeps. False if the shape's middle is not behind the
// triangle.
bool Retrieve(const Geometry& convex, const TrianglePlace& place, LocalManifold* out);

}  // namespace tessera::physics
