// Triangles of the shapes that a scene can have, as OpenGL draws them.
//
// Thread rule: free functions; any thread. They only read what the client's scene gives.
#pragma once

#include <array>
#include <vector>

#include "tessera/tessera.hpp"
#include "vectors.h"

namespace desktop {

struct Vertex {
  Vec3 position, normal;
  Vec3 colour{1, 1, 1};          // its own, linear, where a mesh is drawn in its colours
  std::array<float, 2> place{};  // in the picture that the mesh is painted with, from the upper left
};
using Mesh = std::vector<Vertex>;  // three a triangle, counter-clockwise from outside

// A shape that is no compound, with its place in the body.
struct Part {
  const tessera_shape* shape = nullptr;
  std::array<double, 3> position{};
  std::array<double, 4> orientation{0, 0, 0, 1};
};

// A compound's parts, down to the last; else the shape itself.
std::vector<Part> PartsOf(const tessera_shape* shape);
// Empty for a compound. A plane is a square of `plane_half_m` around the point nearest to the origin.
Mesh MeshOf(const tessera::ShapeInfo& shape, float plane_half_m);
// Triangles around these points, three floats each; empty where they span no volume.
Mesh ConvexHull(const float* points, std::size_t count);

std::array<double, 4> Multiply(const std::array<double, 4>& a, const std::array<double, 4>& b);
std::array<double, 3> Rotate(const std::array<double, 4>& q, const std::array<double, 3>& v);

}  // namespace desktop
