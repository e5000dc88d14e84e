// Impacts: restitution, for contacts that have any.
//
// Before a substep is solved, each such contact asks whether it reaches its surface within it, and how fast it will be
// there. If so the bodies are given, at once, the velocities and places that they have at the end of the substep after
// bouncing at that very moment: with e = 1 a ball's energy stays. Bodies then act on each other pair by pair until none
// approach, so that a row of touching balls passes a blow on to the last one. The solver finds nothing left to do.
//
// Thread rule: one thread at a time.
#pragma once

#include <span>
#include <vector>

#include "core/physics/solve/contact_blocks.h"

namespace tessera::physics {

// A contact that may bounce. Pointers go into its block.
struct ImpactPoint {
  Vec3f angular_a, angular_b;  // mass-normalised
  float mass = 0;
  const float* separation = nullptr;
  float* total = nullptr;
  float target = 0;   // velocity that it is to have after this substep
  float impulse = 0;  // of this substep
  bool hits = false;
};

struct ImpactContact {
  std::uint32_t a = 0, b = 0;
  Vec3f normal;
  float inverse_root_mass_a = 0, inverse_root_mass_b = 0;
  float restitution = 0;
  float* friction = nullptr;  // where friction reads of impacts; null if there is none
  int count = 0;
  ImpactPoint points[kManifoldPoints];
};

class Impacts {
 public:
  // After the blocks are prepared.
  void Fill(std::span<const ContactConstraint> contacts, ContactBlocks& blocks, std::size_t bodies);
  // After the kick of each substep. `before`: velocities before it.
  void Bounce(SolvedState* states, const SolvedMass* masses, SolvedMemory* before, const SolvedKick* kicks, float h);

  bool empty() const { return contacts_.empty(); }

 private:
  std::vector<ImpactContact> contacts_;
  std::vector<std::uint32_t> bodies_;  // that are in them, each once
  std::vector<bool> listed_;           // by body
  std::vector<Vec3f> shifts_;          // by body, m: see Bounce
};

}  // namespace tessera::physics
