// The bounds of the world in tests of records.
#pragma once

#include "core/world/bounds.h"

namespace tessera::replication {

constexpr Aabb kBounds{{-500, -10, -500}, {500, 200, 500}};

}  // namespace tessera::replication
