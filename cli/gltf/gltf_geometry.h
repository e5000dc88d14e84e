// Triangles and points of a glTF model, read with every index, length and offset checked: a file may claim anything.
//
// Thread rule: free functions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/world/math.h"

namespace tinygltf {
class Model;
}

namespace tessera::cli {

struct Triangles {
  std::vector<Vec3d> vertices;         // m, in the mesh's own coordinates
  std::vector<std::uint32_t> indices;  // three a triangle, counter-clockwise from outside
  std::size_t degenerate = 0;          // triangles without area, which were left out
  std::size_t other_primitives = 0;    // points and lines, which were left out
};

// Adds what primitives of a mesh make: lists, strips and fans of triangles, indexed or not. Errors: INVALID_ARGUMENT
// that names mesh, primitive and field.
absl::StatusOr<Triangles> ReadMesh(const tinygltf::Model& model, int mesh);

// Triangles of one primitive, to be drawn. Normals, colours and places: none, or one for each position.
struct Surface {
  std::vector<Vec3f> positions, normals;
  std::vector<Vec3f> colours;                // red, green and blue, linear, 0 to 1
  std::vector<std::array<float, 2>> places;  // in the picture of its material, from the upper left
  std::vector<std::uint32_t> indices;        // three a triangle
  int material = -1;                         // its number in the model, if it has one
};

// The same primitives one by one, those without a triangle left out. Errors as above.
absl::StatusOr<std::vector<Surface>> ReadSurfaces(const tinygltf::Model& model, int mesh);

// Leaves out triangles that have less area than floats can tell, and vertices that none needs.
void DropDegenerate(Triangles& triangles);

}  // namespace tessera::cli
