// BodyClaim: a body and an epoch of its ownership.
#pragma once

#include <compare>

#include "core/world/ids.h"

namespace tessera::region {

struct BodyClaim {
  BodyId body;
  Epoch epoch;
  friend auto operator<=>(const BodyClaim&, const BodyClaim&) = default;
};

}  // namespace tessera::region
