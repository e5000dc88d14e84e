// Surface: the triangles of a mesh or of a height field, and which of them are neighbours.
//
// Counter-clockwise is outward. Contacts and sweeps both take their triangles from here.
//
// Thread rule: immutable once made; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "core/physics/body_frame.h"
#include "core/physics/bounds.h"
#include "core/physics/collide/height_grid.h"
#include "core/physics/collide/mesh_topology.h"
#include "core/physics/collide/triangle_tree.h"
#include "core/world/bounds.h"

namespace tessera::physics {

class Surface {
 public:
  static constexpr std::size_t kRing = 64;  // most neighbours of a vertex that are looked at
  static constexpr float kSharp = 0.866f;   // cosine of 30 degrees
  static constexpr std::size_t kAllTriangles = std::numeric_limits<std::size_t>::max();

  explicit Surface(const TriangleMeshShape& mesh);
  Surface(const HeightFieldShape& field, const BodyFrame& frame);

  bool is_field() const { return tree_ == nullptr; }
  const Bounds& bounds() const { return bounds_; }
  // Length of a piece of a long way, m, so that a box about it holds few triangles.
  double PieceLength() const;

  // Appends the triangles that may reach into the box, in an order that depends on the surface alone. The box is
  // widened by a little first, so that rounding loses none. Once more than `most` are in `found`, no more are looked
  // for.
  void TrianglesIn(const Aabb& box, std::vector<std::uint32_t>* found, std::size_t most = kAllTriangles) const;

  std::array<Vec3d, 3> Corners(std::uint32_t triangle) const;
  // In single precision, for sweeps.
  std::array<Vec3f, 3> RoundedCorners(std::uint32_t triangle) const;
  // Outward, unit; 0 for a triangle without extent, with which no contact is made.
  Vec3f Normal(std::uint32_t triangle) const;
  // Whether at one of its corners some triangle falls away from its neighbour by more than `kSharp`, or has none.
  bool IsSharp(std::uint32_t triangle) const;
  // Whether there is ground behind it: part of a closed surface or of a height field, rather than of a sheet.
  bool IsSolid(std::uint32_t triangle) const;
  // The third corner of the triangle across the edge from corner `edge` to the next one; false at the border.
  bool Opposite(std::uint32_t triangle, std::size_t edge, Vec3d* corner) const;
  // The vertices that edges join to a corner. Returns how many.
  std::size_t Ring(std::uint32_t triangle, std::size_t corner, std::span<Vec3d, kRing> vertices) const;

  const HeightFieldShape& field() const { return grid_.field(); }

 private:
  std::array<std::size_t, 3> VerticesOf(std::uint32_t triangle) const;
  void MarkSharpCorners(std::size_t vertices, std::uint32_t triangles);

  // A mesh.
  MeshTopology mesh_;
  std::unique_ptr<const TriangleTree> tree_;
  // A height field.
  HeightGrid grid_;

  Bounds bounds_;
  std::vector<std::uint8_t> sharp_;  // by vertex
};

}  // namespace tessera::physics
