// Behind Region: the end of a tick, which begins and failovers end with too.
#pragma once

#include <vector>

#include "core/region/region_parts.h"

namespace tessera::region {

// Finds whether nothing here can concern a neighbour soon: before handovers are decided on.
void FindInland(RegionParts& parts);

// Finds what acts on the bodies in the next step, and which of them each neighbour must have as ghosts.
void FindRelevant(RegionParts& parts);

// Passes on the area effects that may leave.
void SendBlasts(RegionParts& parts);

// The frames to all neighbours that get one.
std::vector<OutgoingFrame> MakeFrames(RegionParts& parts);

// The message for the standby. Requires parts.log.on().
Bytes WriteLog(RegionParts& parts);

}  // namespace tessera::region
