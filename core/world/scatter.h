// The places of the bodies of a scatter. They are the same on every machine, because only integers and correctly
// rounded operations make them.
//
// For use inside core/world only. Any thread.
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

  // Number of bodies that fit in a layer.
  std::uint64_t LayerCapacity() const;
  // Height of the topmost of `count` > 0 bodies.
  double TopOf(std::uint32_t count) const;
};

// Calls `place(i, position)` for each of `count` bodies. Layers stand `spacing_m` apart from area.min.y upward. All but
// the last are full; a layer spreads its bodies over the whole area as MakeGridMap spreads regions, so that as many
// bodies as regions of a square world are one for each.
void ForEachScattered(const ScatterGrid& grid, std::uint32_t count,
                      const std::function<void(std::uint32_t, Vec3d)>& place);

}  // namespace tessera
