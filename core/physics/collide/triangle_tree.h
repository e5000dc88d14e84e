// TriangleTree: the triangles of a mesh that may reach into a box, found with Bullet's tree of bounds.
//
// Thread rule: immutable once made; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/world/bounds.h"
#include "core/world/scene.h"

namespace tessera::physics {

class TriangleTree {
 public:
  explicit TriangleTree(const TriangleMeshShape& mesh);
  ~TriangleTree();

  // Appends indices of triangles in an order that depends on the mesh alone: every triangle that reaches into the box,
  // and some that only come near it. Once more than `most` are found, the rest is left out.
  void TrianglesIn(const Aabb& box, std::vector<std::uint32_t>* found, std::size_t most) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::physics
