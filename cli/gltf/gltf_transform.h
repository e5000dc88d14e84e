// Where a glTF node is: an affine map, and its parts where it has them.
#pragma once

#include <array>
#include <cmath>
#include <optional>

#include "core/world/math.h"

namespace tessera::cli {

struct Affine {
  // Images of the axes, and of the origin.
  std::array<Vec3d, 3> axes{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  Vec3d origin;

  Vec3d Turned(Vec3d v) const { return axes[0] * v.x + axes[1] * v.y + axes[2] * v.z; }
  Vec3d operator()(Vec3d v) const { return Turned(v) + origin; }
  Affine operator*(const Affine& inner) const {
    return {{Turned(inner.axes[0]), Turned(inner.axes[1]), Turned(inner.axes[2])}, (*this)(inner.origin)};
  }
  double Determinant() const { return Dot(axes[0], Cross(axes[1], axes[2])); }
};

struct Placed {
  Pose pose;
  Vec3d scale{1, 1, 1};  // along the axes of the pose; all positive
};

// The rotation and the scale of a map without shear; nothing for one that shears or flattens. A map that mirrors is one
// that turns and mirrors along x, which no symmetric shape notices.
std::optional<Placed> Parts(const Affine& map);

}  // namespace tessera::cli
