// Inland: whether all that a region owns stays so far inside one of its cells that it concerns no neighbour, whatever
// it does until a neighbour could hear of it. Then nobody needs to look at each body.
//
// Thread rule: free function.
#pragma once

#include "core/region/bodies.h"
#include "core/region/neighborhood.h"
#include "core/region/settings.h"

namespace tessera::region {

// True only if the swept bounds of no owned body, grown by the aura, leave the cell that it is in, within the ticks of
// a promise and those of the look ahead beyond them. Bodies must have nothing to move them but what they touch and
// gravity. Linear in owned bodies, with little for each.
bool AllInland(const Bodies& bodies, const Neighborhood& neighborhood, const RegionSettings& settings,
               Vec3d gravity_m_s2, double tick_s);

}  // namespace tessera::region
