#include "core/physics/collide/height_grid.h"

#include <algorithm>
#include <cmath>

namespace tessera::physics {

std::array<Vec3f, 3> HeightGrid::RoundedCorners(std::uint32_t triangle) const {
  const auto spacing = static_cast<float>(field_.spacing_m), base_y = static_cast<float>(base_y_m_);
  const auto sample = [&](std::uint32_t x, std::uint32_t z) {
    const auto from_middle = [&](std::uint32_t i, std::uint32_t samples) {
      return (static_cast<float>(i) - static_cast<float>(samples - 1) / 2.0f) * spacing;
    };
    return Vec3f{from_middle(x, field_.columns),
                 field_.heights_m[static_cast<std::size_t>(z) * field_.columns + x] + base_y,
                 from_middle(z, field_.rows)};
  };
  const auto [x, z, second] = CellOf(triangle);
  if (second) return {sample(x + 1, z), sample(x, z + 1), sample(x + 1, z + 1)};
  return {sample(x, z), sample(x, z + 1), sample(x + 1, z)};
}

bool HeightGrid::Opposite(std::uint32_t triangle, std::size_t edge, Vec3d* corner) const {
  const auto [x, z, second] = CellOf(triangle);
  const auto sample = [&, column = x, row = z](std::int64_t dx, std::int64_t dz) {
    const std::int64_t sx = column + dx, sz = row + dz;
    if (sx < 0 || sz < 0 || sx >= field_.columns || sz >= field_.rows) return false;
    *corner = Sample(static_cast<std::uint32_t>(sx), static_cast<std::uint32_t>(sz));
    return true;
  };
  if (second) return edge == 0 ? sample(0, 0) : edge == 1 ? sample(0, 2) : sample(2, 0);
  return edge == 0 ? sample(-1, 1) : edge == 1 ? sample(1, 1) : sample(1, -1);
}

std::size_t HeightGrid::Ring(std::uint32_t triangle, std::size_t corner, std::span<Vec3d> samples) const {
  const auto [cell_x, cell_z, second] = CellOf(triangle);
  const std::uint32_t x = cell_x + (corner == 2 || (second && corner == 0) ? 1 : 0);
  const std::uint32_t z = cell_z + (corner == 1 || (second && corner == 2) ? 1 : 0);
  constexpr std::array<std::array<int, 2>, 6> kSteps{{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
  std::size_t count = 0;
  for (const auto& [dx, dz] : kSteps) {
    const std::int64_t sx = static_cast<std::int64_t>(x) + dx, sz = static_cast<std::int64_t>(z) + dz;
    if (sx < 0 || sz < 0 || sx >= field_.columns || sz >= field_.rows) continue;
    samples[count++] = Sample(static_cast<std::uint32_t>(sx), static_cast<std::uint32_t>(sz));
  }
  return count;
}

void HeightGrid::TrianglesIn(const Aabb& box, std::vector<std::uint32_t>* found, std::size_t most) const {
  const auto cell = [&](double p, std::uint32_t samples) {
    const double i = std::floor(p / field_.spacing_m + (samples - 1) / 2.0);
    return static_cast<std::int64_t>(std::clamp(i, -1.0, static_cast<double>(samples)));
  };
  const std::uint32_t columns = field_.columns, rows = field_.rows;
  const auto last_x = static_cast<std::int64_t>(columns) - 2, last_z = static_cast<std::int64_t>(rows) - 2;
  const std::int64_t x0 = std::max<std::int64_t>(cell(box.min.x, columns), 0),
                     x1 = std::min(cell(box.max.x, columns), last_x);
  const std::int64_t z0 = std::max<std::int64_t>(cell(box.min.z, rows), 0),
                     z1 = std::min(cell(box.max.z, rows), last_z);
  const std::vector<float>& heights = field_.heights_m;
  for (std::int64_t z = z0; z <= z1; ++z) {
    for (std::int64_t x = x0; x <= x1; ++x) {
      const std::size_t i = static_cast<std::size_t>(z * columns + x);
      const auto [low, high] =
          std::minmax({heights[i], heights[i + 1], heights[i + columns], heights[i + columns + 1]});
      if (static_cast<double>(low) + base_y_m_ > box.max.y || static_cast<double>(high) + base_y_m_ < box.min.y) {
        continue;
      }
      const auto first = static_cast<std::uint32_t>(2 * (z * (columns - 1) + x));
      found->push_back(first);
      found->push_back(first + 1);
      if (found->size() > most) return;
    }
  }
}

}  // namespace tessera::physics
