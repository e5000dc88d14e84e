// Makes one joint from its message. The caller checks that its bodies exist.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <string>

#include "core/world/faults.h"
#include "core/world/scene.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

// Adds to `faults`, whose place is the joint, the faults of its frames and its kind.
JointDef ResolveJoint(Faults& faults, const v1::Joint& joint);

}  // namespace tessera
