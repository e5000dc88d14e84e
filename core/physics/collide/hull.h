// Hull: the convex hull of points.
#pragma once

#include <memory>
#include <span>

#include "core/physics/collide/polyhedron.h"

namespace tessera::physics {

// The hull of at least four points that do not lie in one plane, with its vertices exactly where the points are.
// Triangles in one plane become one face. Points that rounding spoils, as in a sheet that is far larger than thick, get
// the hull of their bounds.
std::shared_ptr<const Polyhedron> HullOf(std::span<const Vec3f> points);

}  // namespace tessera::physics
