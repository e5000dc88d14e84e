#include "cli/gltf/gltf_transform.h"

#include <algorithm>

namespace tessera::cli {
namespace {

// Exporters write floats.
constexpr double kSheared = 1e-3;

// The quaternion of a rotation by its axes' images, by the largest of its parts (Shepperd 1978).
Quatd QuaternionOf(const std::array<Vec3d, 3>& axes) {
  const auto& [x, y, z] = axes;
  const double trace = x.x + y.y + z.z;
  Quatd q;
  if (trace > std::max({x.x, y.y, z.z})) {
    q = {y.z - z.y, z.x - x.z, x.y - y.x, 1 + trace};
  } else if (x.x >= y.y && x.x >= z.z) {
    q = {1 + x.x - y.y - z.z, x.y + y.x, z.x + x.z, y.z - z.y};
  } else if (y.y >= z.z) {
    q = {x.y + y.x, 1 + y.y - x.x - z.z, y.z + z.y, z.x - x.z};
  } else {
    q = {z.x + x.z, y.z + z.y, 1 + z.z - x.x - y.y, x.y - y.x};
  }
  return Normalized(q);
}

}  // namespace

std::optional<Placed> Parts(const Affine& map) {
  Placed placed;
  placed.scale = {Length(map.axes[0]), Length(map.axes[1]), Length(map.axes[2])};
  const auto usable = [](double scale) { return std::isfinite(scale) && scale > 0; };
  if (!usable(placed.scale.x) || !usable(placed.scale.y) || !usable(placed.scale.z)) return std::nullopt;
  std::array<Vec3d, 3> axes{map.axes[0] / placed.scale.x, map.axes[1] / placed.scale.y, map.axes[2] / placed.scale.z};
  if (std::abs(Dot(axes[0], axes[1])) > kSheared || std::abs(Dot(axes[1], axes[2])) > kSheared ||
      std::abs(Dot(axes[2], axes[0])) > kSheared) {
    return std::nullopt;
  }
  if (map.Determinant() < 0) axes[0] = axes[0] * -1.0;
  placed.pose = {map.origin, QuaternionOf(axes)};
  return placed;
}

}  // namespace tessera::cli
