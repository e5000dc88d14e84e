// Behind Region: another map comes into force.
#pragma once

#include "core/region/region_parts.h"

namespace tessera::region {

// Goes by `map` from now on. What was agreed with neighbours that stay goes on, unless `anew`. Frames that came early
// are taken after it, when neighbours and ticks are right.
void AdoptMap(PartitionMap map, bool anew, RegionParts& parts);

// The same for a planned map, if this tick is the one.
void AdoptMapIfDue(RegionParts& parts);

}  // namespace tessera::region
