// The joints that a game made, as they are in force: while one region owns both bodies. Own records and the ghosts of
// the neighbours have them, so a region and the neighbours that see the bodies step them alike.
//
// A joint whose bodies different regions own waits: the assembly of its lower body is granted to the owner of the other
// one, where both have met in the step that takes it in. So no message is needed, and the grant carries the joint.
//
// Thread rule: one thread at a time.
#pragma once

#include <vector>

#include "core/region/bodies.h"
#include "core/region/handover.h"
#include "core/region/record_table.h"

namespace tessera::region {

// Makes those joints the world's that are in force with these owners and ghosts.
void ConnectGameJoints(const RecordTable& records, Bodies& bodies);
// The bodies whose joints wait for one that a neighbour owns, ascending.
std::vector<Summons> FindSummoned(const RecordTable& records, const Bodies& bodies);

}  // namespace tessera::region
