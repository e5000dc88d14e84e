// Handover: whom a body should go to. The map says who should own its place; hysteresis keeps one that stands on a
// border where it is.
#pragma once

#include <optional>
#include <span>

#include "core/world/partition_map.h"

namespace tessera::region {

// The neighbour to grant an assembly with this anchor (the position of its lowest body) to; none if it stays. The
// place's owner if that is a neighbour, otherwise the neighbour nearest to it (the lowest id on a tie), which passes it
// on.
std::optional<RegionId> HandoverTarget(const PartitionMap& map, RegionId self, std::span<const RegionId> neighbors,
                                       Vec3d anchor, double hysteresis_m);

}  // namespace tessera::region
