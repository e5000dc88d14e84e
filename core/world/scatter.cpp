#include "core/world/scatter.h"

#include <algorithm>
#include <cmath>

#include "core/world/limits.h"

namespace tessera {
namespace {

// Number of spacings that fit into `length`; a quotient that rounding brought just below a whole number counts as it.
std::uint64_t Fit(double length_m, double spacing_m) {
  return static_cast<std::uint64_t>(
      std::clamp(std::floor(length_m / spacing_m * (1 + 1e-12)), 1.0, static_cast<double>(kMaxBodies)));
}

// Sebastiano Vigna's splitmix64 as a function of (seed, n): value n of the sequence that `seed` starts.
std::uint64_t Random(std::uint64_t seed, std::uint64_t n) {
  std::uint64_t z = seed + (n + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

// A number spread evenly over [-1, 1).
double Jitter(std::uint64_t seed, std::uint64_t n) { return static_cast<double>(Random(seed, n) >> 11) * 0x1p-52 - 1; }

}  // namespace

std::uint64_t ScatterGrid::LayerCapacity() const {
  return Fit(area.max.x - area.min.x, spacing_m) * Fit(area.max.z - area.min.z, spacing_m);
}

double ScatterGrid::TopOf(std::uint32_t count) const {
  const std::uint64_t top_layer = (count - 1) / LayerCapacity();
  return area.min.y + static_cast<double>(top_layer) * spacing_m;
}

void ForEachScattered(const ScatterGrid& grid, std::uint32_t count,
                      const std::function<void(std::uint32_t, Vec3d)>& place) {
  const double width = grid.area.max.x - grid.area.min.x, depth = grid.area.max.z - grid.area.min.z;
  const std::uint64_t max_rows = Fit(depth, grid.spacing_m), capacity = grid.LayerCapacity();
  const std::uint64_t max_columns = capacity / max_rows;
  for (std::uint64_t first = 0; first < count; first += capacity) {
    const std::uint64_t in_layer = std::min<std::uint64_t>(capacity, count - first);
    const auto even = static_cast<std::uint64_t>(std::ceil(std::sqrt(static_cast<double>(in_layer) * width / depth)));
    const std::uint64_t columns =
        std::clamp(even, (in_layer + max_rows - 1) / max_rows, std::max<std::uint64_t>(1, max_columns));
    const std::uint64_t rows = (in_layer + columns - 1) / columns;
    const std::uint64_t layer = first / capacity;
    const double y = grid.area.min.y + static_cast<double>(layer) * grid.spacing_m;
    for (std::uint64_t i = 0; i < in_layer; ++i) {
      const std::uint64_t row = i / columns, column = i % columns;
      const std::uint64_t in_row = row + 1 < rows ? columns : in_layer - columns * (rows - 1);
      const double x = (static_cast<double>(column) + 0.5) / static_cast<double>(in_row) * width;
      const double z = (static_cast<double>(row) + 0.5) / static_cast<double>(rows) * depth;
      const std::uint64_t body = first + i;
      place(static_cast<std::uint32_t>(body), {grid.area.min.x + x + grid.jitter_m * Jitter(grid.seed, 2 * body), y,
                                               grid.area.min.z + z + grid.jitter_m * Jitter(grid.seed, 2 * body + 1)});
    }
  }
}

}  // namespace tessera
