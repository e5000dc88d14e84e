#include "core/replication/interest.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace tessera::replication {
namespace {

// Cells across the radius of interest: more follow its circle closer, and cost more to look through.
constexpr double kCellsInRadius = 4;
constexpr double kMinCell_m = 1;
constexpr int kMaxColumns = 128;
// How far beyond its cell's edge a body still counts as in it, in lengths of a cell.
constexpr double kStay = 0.1;

// How far beyond the radius a cell stays in view, as a share of the radius.
constexpr double kKeep = 1.0 / 6;
// A place that has moved less than this, in lengths of a cell, sees the same cells.
constexpr double kMoved = 0.2;

}  // namespace

CellGrid::CellGrid(const Aabb& world_bounds, double interest_radius_m)
    : min_x_(world_bounds.min.x), min_z_(world_bounds.min.z), cell_m_(0) {
  if (interest_radius_m <= 0) return;
  const double length_m = world_bounds.max.x - world_bounds.min.x, width_m = world_bounds.max.z - world_bounds.min.z;
  cell_m_ = std::max({interest_radius_m / kCellsInRadius, kMinCell_m, length_m / kMaxColumns, width_m / kMaxColumns});
  columns_ = std::max(1, static_cast<int>(std::ceil(length_m / cell_m_)));
  rows_ = std::max(1, static_cast<int>(std::ceil(width_m / cell_m_)));
}

int CellGrid::Place(double offset_m, int count) const {
  if (count == 1 || !(offset_m > 0)) return 0;
  return static_cast<int>(std::min(std::floor(offset_m / cell_m_), static_cast<double>(count - 1)));
}

double CellGrid::Distance(int column, int row, double x, double z) const {
  const Rect cell{min_x_ + column * cell_m_, min_z_ + row * cell_m_, min_x_ + (column + 1) * cell_m_,
                  min_z_ + (row + 1) * cell_m_};
  return cell.DistanceTo(x, z);
}

std::uint32_t CellGrid::CellAt(Vec3d position, std::optional<std::uint32_t> before) const {
  const int column = ColumnOf(position.x), row = RowOf(position.z);
  if (before.has_value()) {
    const int was_column = static_cast<int>(*before) % columns_, was_row = static_cast<int>(*before) / columns_;
    if (std::abs(column - was_column) <= 1 && std::abs(row - was_row) <= 1 &&
        Distance(was_column, was_row, position.x, position.z) <= kStay * cell_m_) {
      return *before;
    }
  }
  return IndexOf(column, row);
}

bool InterestWindow::Follow(const CellGrid& grid, double radius_m, const std::optional<Vec3d>& centre) {
  if (radius_m <= 0 || !centre.has_value()) {
    if (sees_all_) return false;
    sees_all_ = true;
    at_.reset();
    seen_.resize(static_cast<std::size_t>(grid.columns()) * static_cast<std::size_t>(grid.rows()));
    std::iota(seen_.begin(), seen_.end(), 0u);
    return true;
  }
  sees_all_ = false;
  if (at_.has_value() && std::hypot(centre->x - at_->x, centre->z - at_->z) < kMoved * grid.cell_m()) return false;
  at_ = centre;
  const double keep_m = radius_m * (1 + kKeep);
  std::vector<std::uint32_t> now;
  for (int row = grid.RowOf(centre->z - keep_m); row <= grid.RowOf(centre->z + keep_m); ++row) {
    for (int column = grid.ColumnOf(centre->x - keep_m); column <= grid.ColumnOf(centre->x + keep_m); ++column) {
      const double distance_m = grid.Distance(column, row, centre->x, centre->z);
      const std::uint32_t cell = grid.IndexOf(column, row);
      if (distance_m <= radius_m || (distance_m <= keep_m && Sees(cell))) now.push_back(cell);
    }
  }
  if (now == seen_) return false;
  seen_ = std::move(now);
  return true;
}

bool InterestWindow::Sees(std::uint32_t cell) const { return std::binary_search(seen_.begin(), seen_.end(), cell); }

std::vector<std::uint32_t> NeighboursInARow(std::span<const std::optional<Vec3d>> places, double radius_m) {
  // By squares, along a Z-order curve: the bits of both coordinates in turns.
  const double square_m = std::max(radius_m / kCellsInRadius, kMinCell_m);
  const auto spread = [&](double x) {
    const double at = std::clamp(std::floor(x / square_m) + 32768, 0.0, 65535.0);
    std::uint64_t bits = 0;
    for (int i = 0; i < 16; ++i) bits |= ((static_cast<std::uint64_t>(at) >> i) & 1) << (2 * i);
    return bits;
  };
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  keys.reserve(places.size());
  for (const std::optional<Vec3d>& place : places) {
    const std::uint64_t key =
        place.has_value() ? spread(place->x) | spread(place->z) << 1 : std::numeric_limits<std::uint64_t>::max();
    keys.emplace_back(key, static_cast<std::uint32_t>(keys.size()));
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order;
  order.reserve(keys.size());
  for (const auto& key : keys) order.push_back(key.second);
  return order;
}

}  // namespace tessera::replication
