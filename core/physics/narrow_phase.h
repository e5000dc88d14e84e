// NarrowPhase: where the bodies of each active pair touch, or may touch in this step, and which sleepers wake by it.
//
// It searches the contact points of every active pair from the predicted motions of its bodies, ends pairs whose bounds
// have come apart, and wakes bodies that something awake may touch, together with the pairs that they bring.
//
// Promise: contacts ascend by the ids of their bodies, whatever the order in which pairs were found.
// Thread rule: one thread at a time.
#pragma once

#include <span>
#include <vector>

#include "core/physics/active_contact.h"
#include "core/physics/pair_table.h"
#include "core/physics/waking.h"

namespace tessera::physics {

class NarrowPhase {
 public:
  void Run(double dt_s, PairTable& pairs, Waking& waking);
  // Forgets the last step.
  void Clear();

  // Pairs with manifolds.
  std::span<ActiveContact> contacts() { return contacts_; }
  std::span<const ActiveContact> contacts() const { return contacts_; }
  // Pairs that touch as far as events have said, but have no manifold any more.
  std::span<Pair* const> parting() const { return parting_; }

  // For assertions; linear in contacts.
  bool Validate(std::span<RigidBody* const> awake) const;

 private:
  void Collide(Pair& pair, double dt_s, PairTable& pairs);
  void List(Pair& pair);

  std::vector<ActiveContact> contacts_;
  std::vector<Pair*> parting_;
  std::vector<RigidBody*> sleepers_, waking_;  // that something awake may touch
};

}  // namespace tessera::physics
