// What of the world a client is shown: a grid over x-z, and the part of it around a place.
//
//   CellGrid grid(bounds, radius_m);
//   std::uint32_t cell = grid.CellAt(position, before);           // of a body
//   InterestWindow window;
//   if (window.Follow(grid, radius_m, centre)) ...                // of a client: true where it sees other cells now
//   if (window.Sees(cell)) ...
//
// Both hold on to what they have: a body stays in its cell until it is a tenth of it beyond, a cell that is seen stays
// so until it is a sixth beyond the radius. So nothing flickers at an edge. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/world/bounds.h"

namespace tessera::replication {

// The grid over the world; beyond its edges the outermost cells go on. One cell where all is of interest.
class CellGrid {
 public:
  CellGrid(const Aabb& world_bounds, double interest_radius_m);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  std::uint32_t IndexOf(int column, int row) const { return static_cast<std::uint32_t>(row * columns_ + column); }
  int ColumnOf(double x) const { return Place(x - min_x_, columns_); }
  int RowOf(double z) const { return Place(z - min_z_, rows_); }
  // Metres from the point to the cell; 0 inside.
  double Distance(int column, int row, double x, double z) const;
  // The cell of a body that was in `before`: that one still, while it is not far beyond its edge.
  std::uint32_t CellAt(Vec3d position, std::optional<std::uint32_t> before) const;
  double cell_m() const { return cell_m_; }

 private:
  int Place(double offset_m, int count) const;

  double min_x_, min_z_, cell_m_;
  int columns_ = 1, rows_ = 1;
};

// The cells within the radius of a place.
class InterestWindow {
 public:
  // The place is `centre`, or unknown: then all is seen, as where all is of interest (radius_m 0). True if what is seen
  // has changed.
  bool Follow(const CellGrid& grid, double radius_m, const std::optional<Vec3d>& centre);
  bool Sees(std::uint32_t cell) const;
  const std::vector<std::uint32_t>& cells() const { return seen_; }  // ascending

 private:
  std::vector<std::uint32_t> seen_;
  std::optional<Vec3d> at_;  // where it was last looked from
  bool sees_all_ = false;
};

// The order in which to write to those who look from `places`: neighbours in a row, so that what they see both is still
// at hand for the second. Those without a place come last.
std::vector<std::uint32_t> NeighboursInARow(std::span<const std::optional<Vec3d>> places, double radius_m);

}  // namespace tessera::replication
