// GrowHull: the triangles of a convex hull, grown point by point (the beneath-beyond method).
//
// The work is done in coordinates along the edges of a first tetrahedron of points, in which every hull is about 1 wide
// in every direction; so the sides of a needle or of a sheet are kept apart too. A change of coordinates changes no
// hull.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/world/math.h"

namespace tessera::physics {

// Counter-clockwise from outside, in the hull's own coordinates.
struct HullTriangle {
  std::array<std::uint32_t, 3> v{};
  Vec3d normal;  // unit, outward
  double offset = 0;
  bool alive = true;
};

struct GrownHull {
  std::vector<Vec3d> given;   // the points, m
  std::vector<Vec3d> points;  // the same points in the hull's own coordinates
  std::vector<HullTriangle> triangles;
};

// A point above a triangle by no more than `rounding` counts as on it. No triangles if the points span no volume.
GrownHull GrowHull(std::span<const Vec3f> points, double rounding);

}  // namespace tessera::physics
