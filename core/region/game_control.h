// Bodies that players who are not theirs move, as core/game/control_calls.h describes it: whose inputs push what, and
// the players' own bodies, which stand aside and go along.
//
// Thread rule: one thread at a time.
#pragma once

namespace tessera::region {

struct RegionParts;

// Finds again whose inputs move what.
void FindDriven(RegionParts& parts);
// Puts the players' own bodies where the others are after the step.
void FollowDriven(RegionParts& parts);

}  // namespace tessera::region
