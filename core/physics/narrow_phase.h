// NarrowPhase: where the bodies of each active pair touch, or may touch in this step, and which sleepers wake by it.
//
// It searches the contact points of every active pair from the predicted motions of its bodies, ends pairs whose bounds
// have come apart, and wakes bodies that something awake may touch, together with the pairs that they bring.
//
// Promise: contacts ascend by the ids of their bodies, whatever the order in which pairs were found.
// Thread rule: one thread at a time, which leads the team.
#pragma once

#include <span>
#include <vector>

#include "core/physics/active_contact.h"
#include "core/physics/pair_table.h"
#include "core/physics/thread_team.h"
#include "core/physics/waking.h"

namespace tessera::physics {

class NarrowPhase {
 public:
  explicit NarrowPhase(ThreadTeam& team = ThreadTeam::Alone()) : team_(team) {}

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
  // The outcome of the search at one pair.
  struct Finding {
    bool apart = false;                          // its bounds have come apart: it ends
    bool wakes_low = false, wakes_high = false;  // sleepers that something awake may touch
    bool contact = false, parting = false;       // it is to be listed
  };
  static Finding Examine(Pair& pair, double dt_s, ActiveContact* contact);
  static void Search(Pair& pair, double dt_s, Finding* finding);
  static void List(Pair& pair, Finding* finding, ActiveContact* contact);
  void Settle(Pair& pair, const Finding& finding, PairTable& pairs);
  void WakeSleepers(double dt_s, PairTable& pairs, Waking& waking);

  ThreadTeam& team_;
  std::vector<ActiveContact> contacts_;
  std::vector<Pair*> parting_;
  std::vector<Finding> findings_;              // by place of the pair in the walk
  std::vector<ActiveContact> listings_;        // likewise; only those of contacts are written
  std::vector<RigidBody*> sleepers_, waking_;  // that something awake may touch
};

}  // namespace tessera::physics
