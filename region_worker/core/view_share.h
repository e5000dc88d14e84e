// ViewShare: how the regions of a world divide what one client may be sent a second, without asking each other.
//
//   view.budget_share = ViewShare(map, self, place_of_the_body, radius_m);
//
// All regions know the map and where the client's body is, so their shares come to one. Pure, any thread.
#pragma once

#include "core/world/ids.h"
#include "core/world/math.h"
#include "core/world/partition_map.h"

namespace tessera::worker {

// The region's part, 0 to 1, of what a client sees from `centre`: as much as its cells have of the square of half side
// `radius_m` around it. The region that holds the place has half at least, for it has what is nearest; a tenth is dealt
// out evenly to the others, for what they have that has left their cells. `radius_m` is positive.
double ViewShare(const PartitionMap& map, RegionId self, Vec3d centre, double radius_m);

}  // namespace tessera::worker
