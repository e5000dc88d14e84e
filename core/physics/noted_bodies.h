// NotedBodies: the bodies whose poses a world remembers, by whose they are.
//
// Thread rule: plain values.
#pragma once

#include <span>

#include "core/world/ids.h"

namespace tessera::physics {

// The bodies of a tick, each list ascending: those that the caller owns, those of others, and those that are nobody's,
// because they move by themselves.
struct NotedBodies {
  std::span<const BodyId> own, ghosts, fixed;
};

}  // namespace tessera::physics
