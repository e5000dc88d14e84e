// Where the bodies of a scatter stand: the same places on every machine, by integers and correctly rounded operations
// alone. Inside core/world only. Any thread.
#pragma once

#include <cstdint>
#include <functional>

#include "core/world/bounds.h"
#include "core/world/math.h"

namespace tessera {

struct ScatterGrid {
  Aabb area;
  double spacing_m = 1;  // at most the area's width and depth
  double jitter_m = 0;   // at most half the spacing
  std::uint64_t seed = 0;

  // Bodies that a layer takes.
  std::uint64_t LayerCapacity() const;
  // Height of the topmost of `count` > 0 bodies.
  double TopOf(std::uint32_t count) const;
};

// Calls `place(i, position)` for each of `count` bodies. Layers stand `spacing_m` apart from area.min.y upward. All but
// the last are full; what a layer holds is spread over the whole area as MakeGridMap spreads regions, so that a few
// bodies on as many regions of a square world are one for each.
void ForEachScattered(const ScatterGrid& grid, std::uint32_t count,
                      const std::function<void(std::uint32_t, Vec3d)>& place);

}  // namespace tessera
