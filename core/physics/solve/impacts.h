// Impacts: restitution, for contacts that have any.
//
// Before a substep is solved, each such contact is asked whether it reaches its surface within the substep, and how
// fast it will be there. If so the bodies get, at once, the velocities and places that they have at the end of the
// substep after bouncing at that very moment: with e = 1 a ball's energy stays. Bodies then act on each other pair by
// pair until none approach, so that a row of touching balls hands a blow on to the last one. The solver finds nothing
// left to do.
//
// Most contacts are not about to hit: a wide kernel picks out the few that approach.
//
// Thread rule: one thread at a time.
#pragma once

#include <span>
#include <vector>

#include "core/physics/solve/contact_blocks.h"

namespace tessera::physics {

class Impacts {
 public:
  // Finds the bodies that may bounce. After the bodies come `worlds` that stand for the world.
  void Fill(std::span<const ContactConstraint> contacts, std::size_t bodies, std::size_t worlds);
  // Bounces, after the kick of each substep; `before` are the velocities before it. Returns whether any body was moved.
  bool Bounce(const Kernels& kernels, ContactBlocks& blocks, SolvedState* states, const SolvedMass* masses,
              SolvedMemory* before, const SolvedKick* kicks, float h);

  bool empty() const { return bodies_.empty(); }

 private:
  bool Shift(SolvedState* states, const SolvedMass* masses, const SolvedMemory* before, const SolvedKick* kicks,
             float h);

  std::vector<std::uint32_t> bodies_;  // those with such contacts, each once
  std::vector<bool> listed_;           // by body
  std::vector<Vec3f> shifts_;          // by body, m, and of those that stand for the world
  std::vector<bool> struck_;           // likewise, in this substep: only a body that was struck may strike on
  std::vector<std::uint8_t> lanes_;    // contacts that approach, by block of a run
};

}  // namespace tessera::physics
