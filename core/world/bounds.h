// Axis-aligned bounds: a box in space, and a rectangle on the ground (x-z), the shape of a partition cell.
#pragma once

#include <algorithm>

#include "core/world/math.h"

namespace tessera {

// A closed box. `min` <= `max` in every axis.
struct Aabb {
  Vec3d min, max;

  friend bool operator==(const Aabb&, const Aabb&) = default;
  bool Contains(Vec3d p) const {
    return p.x >= min.x && p.x <= max.x && p.y >= min.y && p.y <= max.y && p.z >= min.z && p.z <= max.z;
  }
  bool Overlaps(const Aabb& o) const {
    return min.x <= o.max.x && o.min.x <= max.x && min.y <= o.max.y && o.min.y <= max.y && min.z <= o.max.z &&
           o.min.z <= max.z;
  }
  Aabb Expanded(double margin_m) const {
    const Vec3d m{margin_m, margin_m, margin_m};
    return {min - m, max + m};
  }
  Aabb United(const Aabb& o) const {
    return {{std::min(min.x, o.min.x), std::min(min.y, o.min.y), std::min(min.z, o.min.z)},
            {std::max(max.x, o.max.x), std::max(max.y, o.max.y), std::max(max.z, o.max.z)}};
  }
};

// A rectangle in x-z, half open: it holds its lower edges and not its upper ones, so cells that share an edge never
// both hold a point. Height does not matter to a partition.
struct Rect {
  double min_x = 0, min_z = 0, max_x = 0, max_z = 0;

  friend bool operator==(const Rect&, const Rect&) = default;
  bool Contains(double x, double z) const { return x >= min_x && x < max_x && z >= min_z && z < max_z; }
  // True if the closed rectangles meet, be it in a corner.
  bool Touches(const Rect& o) const {
    return min_x <= o.max_x && o.min_x <= max_x && min_z <= o.max_z && o.min_z <= max_z;
  }
  bool Touches(const Aabb& box) const {
    return min_x <= box.max.x && box.min.x <= max_x && min_z <= box.max.z && box.min.z <= max_z;
  }
  // Distance in metres from the point to the rectangle; 0 inside.
  double DistanceTo(double x, double z) const {
    const double dx = std::max({min_x - x, 0.0, x - max_x});
    const double dz = std::max({min_z - z, 0.0, z - max_z});
    return std::hypot(dx, dz);
  }
  double Area() const { return (max_x - min_x) * (max_z - min_z); }
};

}  // namespace tessera
