// Rays against shapes, in closed form and in doubles, in the frame of the shape.
//
//   std::optional<SurfaceHit> hit = HitConvex(geometry, {.from = {0, 5, 0}, .along = {0, -10, 0}});
//
// Thread rule: free functions; any thread.
#pragma once

#include <array>
#include <optional>

#include "core/physics/collide/geometry.h"

namespace tessera::physics {

// The point at t is from + along * t, for t from 0 to 1.
struct LocalRay {
  Vec3d from, along;

  Vec3d At(double t) const { return from + along * t; }
  // Against the ray, unit; 0 where it has no length.
  Vec3d Back() const { return Normalized(-along, Vec3d()); }
};

struct SurfaceHit {
  double fraction = 0;
  Vec3d point, normal;
};

// The first hit on a convex shape. A ray that begins inside has fraction 0, its beginning and Back(); one that only
// leaves the shape at its beginning has no hit.
std::optional<SurfaceHit> HitConvex(const Geometry& convex, const LocalRay& ray);
// The same for what is solid below dot(normal, p) = offset.
std::optional<SurfaceHit> HitPlane(const Geometry& plane, const LocalRay& ray);
// From either side; the normal looks against the ray. A ray along the triangle misses it.
std::optional<SurfaceHit> HitTriangle(const std::array<Vec3d, 3>& corners, const LocalRay& ray);

}  // namespace tessera::physics
