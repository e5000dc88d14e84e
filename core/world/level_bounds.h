// Bounds of what stands still, from its shape and pose, without physics.
//
// Thread rule: free functions.
#pragma once

#include <span>

#include "core/world/bounds.h"
#include "core/world/scene.h"

namespace tessera {

inline Vec3d PlacedAt(const Pose& pose, Vec3d local) { return pose.position + Rotate(pose.orientation, local); }

// Grows with the points that it is given; `Get` once there was one.
class GrowingBounds {
 public:
  void Add(Vec3d point) { Add(Aabb{point, point}); }
  void Add(const Aabb& box) {
    bounds_ = any_ ? bounds_.United(box) : box;
    any_ = true;
  }
  bool any() const { return any_; }
  const Aabb& Get() const { return bounds_; }

 private:
  Aabb bounds_;
  bool any_ = false;
};

// Holds the shape, and may be somewhat larger. Requires that it is no plane.
Aabb BoundsOf(const Shape& shape, const Pose& pose);

// The place of a height field's sample in the field's own coordinates.
inline Vec3d SampleAt(const HeightFieldShape& field, std::uint32_t column, std::uint32_t row) {
  return {(column - (field.columns - 1) / 2.0) * field.spacing_m,
          field.heights_m[std::size_t{row} * field.columns + column], (row - (field.rows - 1) / 2.0) * field.spacing_m};
}

}  // namespace tessera
