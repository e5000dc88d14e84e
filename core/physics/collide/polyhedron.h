// Polyhedron: a convex polyhedron by its faces and edges, and the questions that pair functions ask of it.
//
// Thread rule: immutable once made; any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/world/math.h"

namespace tessera::physics {

struct Polyhedron {
  // A loop of vertices, counter-clockwise from outside.
  struct Face {
    Vec3f normal;                        // unit, outward
    float offset_m = 0;                  // dot(normal, p) on the face
    std::uint32_t first = 0, count = 0;  // the loop is loops[first] to loops[first + count]
  };
  struct Edge {
    std::uint32_t a = 0, b = 0;         // vertices
    std::uint32_t left = 0, right = 0;  // faces
  };
  std::vector<Vec3f> vertices;
  std::vector<std::uint32_t> loops;
  std::vector<Face> faces;
  std::vector<Edge> edges;
  Vec3f inside;  // a point well inside
};

std::shared_ptr<const Polyhedron> BoxOf(Vec3f half_extents_m);

// Finds the edges from the loops of the faces. False where the faces do not close.
bool JoinFaces(Polyhedron* polyhedron);

// The vertex furthest along `direction`; the first of equals.
std::uint32_t SupportVertex(const Polyhedron& polyhedron, Vec3f direction);

struct PolyhedronPoint {
  Vec3f point;
  Vec3f normal;          // unit, from the surface to the given point; inside, out of the nearest face
  float distance_m = 0;  // negative inside
};
// The point of the surface nearest to `from`, which may lie inside. Where the distance exceeds `enough_m`, the answer
// may be any lower bound above that.
PolyhedronPoint NearestOn(const Polyhedron& polyhedron, Vec3f from, float enough_m);

}  // namespace tessera::physics
