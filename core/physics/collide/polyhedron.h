// Polyhedra: how one is made from points, and what the pair functions ask of it.
#pragma once

#include <memory>
#include <span>

#include "core/physics/collide/geometry.h"

namespace tessera::physics {

// The hull of points that do not lie in one plane, with the vertices just where the points are. Triangles in one plane
// are merged to one face.
std::shared_ptr<const Polyhedron> HullOf(std::span<const Vec3f> points);
std::shared_ptr<const Polyhedron> BoxOf(Vec3f half_extents_m);

// Finds the edges from the faces' loops. False where the faces do not close.
bool JoinFaces(Polyhedron* polyhedron);

// The vertex furthest along `direction`; the first of equals.
std::uint32_t Support(const Polyhedron& polyhedron, Vec3f direction);

// The surface point nearest to `from`, which may be inside.
struct PolyhedronPoint {
  Vec3f point;
  Vec3f normal;          // unit, from the surface to `from`, or out of the nearest face where it is inside
  float distance_m = 0;  // negative inside
};
// Where the distance is more than `enough_m`, any lower bound above that may come back as the distance.
PolyhedronPoint NearestOn(const Polyhedron& polyhedron, Vec3f from, float enough_m);

}  // namespace tessera::physics
