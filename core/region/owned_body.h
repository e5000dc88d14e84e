// OwnedBody: a dynamic body that a region owns, as it is after the last step.
#pragma once

#include "core/world/ids.h"
#include "core/world/scene.h"

namespace tessera::region {

struct OwnedBody {
  const BodyDef* def = nullptr;
  Epoch epoch;
  BodyState state;
};

}  // namespace tessera::region
