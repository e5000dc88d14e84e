// HeightGrid: the triangles of a height field, cut from its cells on the fly.
//
// Each cell is cut along the diagonal from (x + 1, z) to (x, z + 1), as Bullet cuts it. Triangle 2 i is the half of
// cell i at (x, z), triangle 2 i + 1 the other half; counter-clockwise is up. Cells count along x first.
//
// Thread rule: immutable once made.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/world/bounds.h"
#include "core/world/scene.h"

namespace tessera::physics {

class HeightGrid {
 public:
  HeightGrid() = default;
  // `base_y_m` is added to every height.
  HeightGrid(const HeightFieldShape& field, double base_y_m) : field_(field), base_y_m_(base_y_m) {}

  const HeightFieldShape& field() const { return field_; }
  std::uint32_t triangle_count() const { return 2 * (field_.columns - 1) * (field_.rows - 1); }

  // Indices of a triangle's corners among the samples.
  std::array<std::size_t, 3> VerticesOf(std::uint32_t triangle) const {
    const auto [x, z, second] = CellOf(triangle);
    const std::size_t i = static_cast<std::size_t>(z) * field_.columns + x;
    if (second) return {i + 1, i + field_.columns, i + field_.columns + 1};
    return {i, i + field_.columns, i + 1};
  }
  std::array<Vec3d, 3> Corners(std::uint32_t triangle) const {
    const auto [x, z, second] = CellOf(triangle);
    if (second) return {Sample(x + 1, z), Sample(x, z + 1), Sample(x + 1, z + 1)};
    return {Sample(x, z), Sample(x, z + 1), Sample(x + 1, z)};
  }
  // The corners in single precision, rounded to the bit as Bullet rounds them.
  std::array<Vec3f, 3> RoundedCorners(std::uint32_t triangle) const;

  // The third corner of the triangle across the edge from corner `edge` to the next one; false at the border.
  bool Opposite(std::uint32_t triangle, std::size_t edge, Vec3d* corner) const;
  // The samples that edges join to a corner; at most six. Returns how many.
  std::size_t Ring(std::uint32_t triangle, std::size_t corner, std::span<Vec3d> samples) const;

  // Appends the triangles of cells that may reach into the box, ascending, until more than `most` are found.
  void TrianglesIn(const Aabb& box, std::vector<std::uint32_t>* found, std::size_t most) const;

 private:
  struct GridCell {
    std::uint32_t x, z;
    bool second;  // the half towards (x + 1, z + 1)
  };
  GridCell CellOf(std::uint32_t triangle) const {
    const std::uint32_t cell = triangle / 2, across = field_.columns - 1;
    return {cell % across, cell / across, triangle % 2 == 1};
  }
  Vec3d Sample(std::uint32_t x, std::uint32_t z) const {
    const std::size_t i = static_cast<std::size_t>(z) * field_.columns + x;
    return {(x - (field_.columns - 1) / 2.0) * field_.spacing_m, field_.heights_m[i] + base_y_m_,
            (z - (field_.rows - 1) / 2.0) * field_.spacing_m};
  }

  HeightFieldShape field_;
  double base_y_m_ = 0;
};

}  // namespace tessera::physics
