// OwedImpulse: the part of a correction that a body here, or a ghost by its owner, is still to get.
#pragma once

#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera::region {

struct OwedImpulse {
  BodyId id;
  Vec3d impulse_ns, angular_nms;  // the latter about `at`
  Vec3d at;                       // where the body was when it became due
};

}  // namespace tessera::region
