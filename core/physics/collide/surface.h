// Surface: the triangles of a mesh or height field, and which of them are neighbours.
//
// Counter-clockwise is outward. Vertices at the same place are one, so meshes that repeat them along their seams are
// smooth there too. A height field's triangles are cut from its cells on the fly, whatever its size, the way Bullet
// cuts them: along the diagonal from (x + 1, z) to (x, z + 1).
//
// Thread rule: immutable once made.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/physics/linear.h"
#include "core/physics/shapes.h"

namespace tessera::physics {

class Surface {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;
  static constexpr std::size_t kRing = 64;  // neighbours of a vertex that are looked at
  static constexpr float kSharp = 0.866f;   // cosine of 30 degrees

  // As seen from the body's frame, like the Bullet shape.
  static std::shared_ptr<const Surface> Of(const TriangleMeshShape& mesh, const BodyFrame& frame);
  static std::shared_ptr<const Surface> Of(const HeightFieldShape& field, const BodyFrame& frame);

  bool is_field() const { return triangles_.empty(); }
  // Outward, unit; 0 where a triangle has no extent: no contact is made with it.
  Vec3f Normal(std::uint32_t triangle) const;
  // Whether at one of its corners some triangle falls away from its neighbour by more than `kSharp`, or has none.
  bool IsSharp(std::uint32_t triangle) const;

  // Part of a closed surface, or of a height field: there is ground behind it. Else it is part of a sheet.
  bool IsSolid(std::uint32_t triangle) const;

  std::array<Vec3d, 3> Corners(std::uint32_t triangle) const;
  // The third corner of the triangle on the other side of the edge from corner `edge` to the next; false at the border.
  bool Opposite(std::uint32_t triangle, std::size_t edge, Vec3d* corner) const;
  // The vertices that edges join to a corner. Returns how many.
  std::size_t Ring(std::uint32_t triangle, std::size_t corner, std::span<Vec3d, kRing> vertices) const;

  // Of a height field: triangles of cells that may reach into the bounds, ascending.
  void FieldTriangles(Vec3d min, Vec3d max, std::vector<std::uint32_t>* found) const;

 private:
  struct Cell {
    std::uint32_t x, z;
    bool second;  // the half towards (x + 1, z + 1)
  };
  std::array<std::size_t, 3> VerticesOf(std::uint32_t triangle) const;
  void MarkSharpCorners(std::uint32_t triangles);
  Cell CellOf(std::uint32_t triangle) const;
  Vec3d Sample(std::uint32_t x, std::uint32_t z) const;
  void JoinEdges();
  void MakeRings();
  void FindSheets();
  void Weld(const TriangleMeshShape& mesh);

  // Mesh.
  struct Triangle {
    std::array<std::uint32_t, 3> corners;
    std::array<std::uint32_t, 3> opposite;  // vertices, or kNone
    Vec3f normal;
    bool solid = true;
  };
  std::vector<Vec3f> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> ring_begin_, ring_;

  std::vector<std::uint8_t> sharp_;  // of vertices

  // Height field.
  std::uint32_t columns_ = 0, rows_ = 0;
  double spacing_m_ = 0, base_y_m_ = 0;
  std::vector<float> heights_m_;
};

}  // namespace tessera::physics
