// Waking: bodies that begin to move, and all that has to move with them.
//
// A body wakes together with everything that joints connect to it, directly or through others. Bodies that it touches
// wake in the next step, when the narrow phase finds that they do.
//
// Thread rule: one thread at a time.
#pragma once

#include <span>
#include <vector>

#include "core/physics/body_store.h"
#include "core/physics/pair_table.h"

namespace tessera::physics {

class Waking {
 public:
  Waking(BodyStore& bodies, PairTable& pairs) : bodies_(bodies), pairs_(pairs) {}

  // Lists a body that is awake already, and makes its pairs active.
  void Activate(RigidBody& body);
  // Wakes a body unless it is static, awake or isolated, and all that joints connect to it.
  void Wake(RigidBody& body);
  // Wakes what a body touches or is jointed to, but not the body itself.
  void WakeNeighbours(const RigidBody& body);

 private:
  BodyStore& bodies_;
  PairTable& pairs_;
  std::vector<RigidBody*> waking_, neighbours_;
};

}  // namespace tessera::physics
