// Interest: which part of the world a client sees. A grid over x-z, and the cells of it around a place.
//
//   CellGrid grid(bounds, radius_m);
//   std::uint32_t cell = grid.CellAt(position, before);           // a body's cell
//   InterestWindow window;
//   if (window.Follow(grid, radius_m, centre)) ...                // a client's; true if it sees other cells now
//   if (window.Sees(cell)) ...
//
// Both have hysteresis, so that nothing flickers at an edge: a body stays in its cell until it is a tenth of a cell
// beyond, and a cell stays in view until it is a sixth of the radius beyond the radius.
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/world/bounds.h"

namespace tessera::replication {

// The grid over the world; beyond its edges the outermost cells go on. It is one cell where interest has no radius.
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
  // The client looks from `centre`. It sees all cells where that is unknown and where radius_m is 0. True if other
  // cells are seen than before.
  bool Follow(const CellGrid& grid, double radius_m, const std::optional<Vec3d>& centre);
  bool Sees(std::uint32_t cell) const;
  const std::vector<std::uint32_t>& cells() const { return seen_; }  // ascending

 private:
  std::vector<std::uint32_t> seen_;
  std::optional<Vec3d> at_;  // where it was last looked from
  bool sees_all_ = false;
};

// The order in which to write to clients that look from `places`: neighbours follow each other, so that the data of
// bodies that both see is still in the caches for the second. Clients without a place come last.
std::vector<std::uint32_t> NeighboursInARow(std::span<const std::optional<Vec3d>> places, double radius_m);

}  // namespace tessera::replication
