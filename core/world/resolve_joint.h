// One joint from its message. Which bodies there are is the caller's to check. Inside core/world only. One thread.
#pragma once

#include <string>

#include "core/world/faults.h"
#include "core/world/scene.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

// Tells `faults`, whose place is the joint, what is wrong with frames and kind.
JointDef ResolveJoint(Faults& faults, const v1::Joint& joint);

}  // namespace tessera
