// Solid: a convex shape as corners, faces and edges with a rounding, in double precision; and how deep two of them
// stand in each other. The arithmetic of the yardstick in bench/penetration.h, which shares nothing with any engine.
//
// A ball is a point with a rounding, a capsule a line with one; cylinders and cones are polytopes of 48 sides inscribed
// in them (their radius is .2 % short). Pure functions, any thread.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/world/bounds.h"
#include "core/world/scene.h"

namespace tessera::bench {

struct Solid {
  std::vector<Vec3d> points;
  std::vector<Vec3d> normals;                         // face normals, unit; one of each opposite pair
  std::vector<Vec3d> edges;                           // directions, unit; one of each parallel set
  std::vector<std::array<std::size_t, 3>> triangles;  // surface triangles; none for a point or a line
  double rounding_m = 0;

  bool thin() const { return points.size() <= 2; }
};

// A convex shape other than plane, in its own coordinates.
Solid SolidOf(const Shape& convex);
// The ground beneath a triangle, down to `thickness_m` below it.
Solid PrismBelow(Vec3d a, Vec3d b, Vec3d c, double thickness_m);
// `solid` as posed.
Solid Posed(const Solid& solid, const Pose& pose);
Aabb BoundsOf(const Solid& solid);

// How far one would have to be moved to touch the other no more, m; negative or 0 if they are apart: for two polytopes
// then any bound, where one is a ball or a capsule their distance. Exact but for rounding: the separating axis theorem
// for the inside, distances of points and lines for the outside.
double DepthBetween(const Solid& a, const Solid& b);
// Below the plane dot(normal, p) = offset.
double DepthInPlane(const Solid& solid, Vec3d normal, double offset_m);

}  // namespace tessera::bench
