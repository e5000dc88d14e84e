// Cast: where a convex shape that moves straight, without turning, first touches another one.
//
// Conservative advancement along the axis that separates the two (Mirtich 1996), by GJK in doubles: each step goes as
// far as the planes that bound the two stay apart, so none passes an impact, and steps shrink as Newton's do.
//
// Thread rule: values and free functions; any thread.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "core/physics/collide/convex.h"
#include "core/physics/query/ray.h"
#include "core/world/query.h"

namespace tessera::physics {

// The moving shape, turned as it is in the world.
class Probe {
 public:
  // `shape` is none of a point.
  Probe(const QueryShape& shape, Quatd orientation);

  // The core and its axes as a frame that is turned by `frame` in the world sees them.
  struct Turned {
    Core core;
    std::array<Vec3d, 3> axes;
    Vec3d half_m{};     // half of the extents of the bounds
    double size_m = 0;  // radius of the ball about the middle that holds the shape
    // Furthest along a direction, from the middle.
    double Reach(Vec3d direction);
  };
  Turned In(Quatd frame) const;

 private:
  std::shared_ptr<const Geometry> geometry_;
  Quatd orientation_;
};

// `target`, which is within `size_m` of its frame's origin. `steps` counts what it took.
std::optional<SurfaceHit> CastAtConvex(const Convex& target, double size_m, Probe::Turned& probe, const LocalRay& ray,
                                       int* steps);
// A half space, solid below dot(normal, p) = offset.
std::optional<SurfaceHit> CastAtPlane(const Geometry& plane, Probe::Turned& probe, const LocalRay& ray);

}  // namespace tessera::physics
