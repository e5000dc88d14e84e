// Bounds: an axis-aligned box in single precision.
//
// The broad phase holds them about the world's origin, collision about a body's. They are wide enough to find what may
// touch; contacts never depend on them.
#pragma once

#include <algorithm>

#include "core/world/math.h"

namespace tessera::physics {

struct Bounds {
  Vec3f min, max;

  bool Contains(const Bounds& b) const {
    return min.x <= b.min.x && min.y <= b.min.y && min.z <= b.min.z && b.max.x <= max.x && b.max.y <= max.y &&
           b.max.z <= max.z;
  }
  bool Overlaps(const Bounds& b) const {
    return min.x <= b.max.x && b.min.x <= max.x && min.y <= b.max.y && b.min.y <= max.y && min.z <= b.max.z &&
           b.min.z <= max.z;
  }
  Bounds Grown(float by_m) const {
    const Vec3f margin{by_m, by_m, by_m};
    return {min - margin, max + margin};
  }
  Bounds Moved(Vec3f by) const { return {min + by, max + by}; }
  // Bounds of everything that the box passes while it moves by `motion`.
  Bounds Swept(Vec3f motion) const {
    const auto low = [](float v) { return std::min(v, 0.0f); };
    const auto high = [](float v) { return std::max(v, 0.0f); };
    return {min + Vec3f{low(motion.x), low(motion.y), low(motion.z)},
            max + Vec3f{high(motion.x), high(motion.y), high(motion.z)}};
  }
  void Include(Vec3f point) {
    min = {std::min(min.x, point.x), std::min(min.y, point.y), std::min(min.z, point.z)};
    max = {std::max(max.x, point.x), std::max(max.y, point.y), std::max(max.z, point.z)};
  }
};

}  // namespace tessera::physics
