#include "core/region/handover.h"

#include <algorithm>

namespace tessera::region {

std::optional<RegionId> HandoverTarget(const PartitionMap& map, RegionId self, std::span<const RegionId> neighbors,
                                       Vec3d anchor, double hysteresis_m) {
  const RegionId owner = map.OwnerOf(anchor);
  if (owner == self) return std::nullopt;
  // Outside the world's bounds the nearest cell counts, so hysteresis is measured along the edge.
  const Rect& bounds = map.bounds();
  const Vec3d place{std::clamp(anchor.x, bounds.min_x, bounds.max_x), anchor.y,
                    std::clamp(anchor.z, bounds.min_z, bounds.max_z)};
  const double own_distance = map.DistanceTo(self, place);
  if (own_distance <= hysteresis_m) return std::nullopt;
  if (std::binary_search(neighbors.begin(), neighbors.end(), owner)) return owner;
  std::optional<RegionId> nearest;
  double best = own_distance;  // a step that leads no nearer would come back
  for (const RegionId neighbor : neighbors) {
    const double distance = map.DistanceTo(neighbor, place);
    if (distance < best) {
      best = distance;
      nearest = neighbor;
    }
  }
  return nearest;
}

}  // namespace tessera::region
