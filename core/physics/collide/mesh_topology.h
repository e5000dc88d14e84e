// MeshTopology: the welded triangles of a mesh and how they hang together: neighbours across edges, vertices around a
// vertex, closed parts and sheets.
//
//   const MeshTopology topology = TopologyOf(mesh);
//
// Counter-clockwise is outward. Vertices at the same place become one, so a mesh that repeats them along its seams is
// smooth there too.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/world/scene.h"

namespace tessera::physics {

struct MeshTriangle {
  static constexpr std::uint32_t kNone = 0xffffffff;

  std::array<std::uint32_t, 3> corners{};
  // The third vertex of the neighbour across the edge from corner i to the next one; kNone at a border.
  std::array<std::uint32_t, 3> opposite{kNone, kNone, kNone};
  Vec3f normal;       // outward, unit; 0 for a triangle without extent
  bool solid = true;  // belongs to a part without a border, so there is ground behind it
};

struct MeshTopology {
  std::vector<Vec3f> vertices;
  std::vector<MeshTriangle> triangles;  // in the order of the mesh
  // The vertices that edges join to vertex v are ring[ring_begin[v]] to ring[ring_begin[v + 1]], ascending.
  std::vector<std::uint32_t> ring_begin, ring;
};

MeshTopology TopologyOf(const TriangleMeshShape& mesh);

}  // namespace tessera::physics
