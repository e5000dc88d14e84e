// Behind Region: the bodies that a region begins with.
#pragma once

#include "core/region/region_parts.h"

namespace tessera::region {

// Owns the assemblies of the scene whose lowest body lies in this region's cells.
void OwnFromScene(RegionParts& parts);

// Owns the bodies of a saved state: all of them if it is this region's own, since what lies a little beyond its cells
// is in nobody else's; otherwise those whose assembly's lowest body lies in this region's cells.
void OwnFromState(const RegionState& initial, RegionParts& parts);

}  // namespace tessera::region
