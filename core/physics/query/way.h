// Way: the straight way of a query, and the part of it that lies in a box.
//
// Thread rule: values; any thread.
#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include "core/physics/linear.h"
#include "core/world/bounds.h"

namespace tessera::physics {

struct WayPart {
  double begin = 0, end = 1;  // shares of the way
};

struct Way {
  Vec3d from, along;

  // None where the way passes the box by. The box is closed.
  std::optional<WayPart> PartIn(const Aabb& box) const {
    WayPart part;
    const auto start = ArrayOf(from), move = ArrayOf(along), low = ArrayOf(box.min), high = ArrayOf(box.max);
    for (std::size_t i = 0; i < 3; ++i) {
      if (move[i] == 0) {
        if (start[i] < low[i] || start[i] > high[i]) return {};
        continue;
      }
      const double one = (low[i] - start[i]) / move[i], other = (high[i] - start[i]) / move[i];
      part.begin = std::max(part.begin, std::min(one, other));
      part.end = std::min(part.end, std::max(one, other));
    }
    return part.begin <= part.end ? std::optional(part) : std::nullopt;
  }
};

}  // namespace tessera::physics
