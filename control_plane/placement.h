// Placement: which host runs which region. Pure, and all or nothing.
//
// Wishes, in this order: every region has a place; if two hosts have room, no host holds all regions, so that each
// region's standby can live elsewhere; as few hosts as that allows, evenly loaded; a host's regions border each other,
// so that most borders stay inside a host.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/partition_map.h"

namespace tessera::control {

// A host that takes regions: ready, not draining.
struct FreeHost {
  std::string id;
  std::uint32_t free = 0;  // places left
  bool avoided = false;    // taken only where no other host has room; Place does not look at it
};

struct PlacedRegion {
  RegionId region;
  std::string host_id;
  friend bool operator==(const PlacedRegion&, const PlacedRegion&) = default;
};

struct PlacementPlan {
  std::vector<PlacedRegion> regions;  // one for each region of the map, ascending
  PartitionMap map;                   // the one given, with standbys chosen
};

// Same input, same plan. kResourceExhausted states need and capacity: "4 regions need 4 places; the 1 ready host has 2
// free".
absl::StatusOr<PlacementPlan> Place(const PartitionMap& map, std::span<const FreeHost> hosts);

}  // namespace tessera::control
