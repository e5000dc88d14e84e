// DirectContacts: those contacts of a batch that bear far more than they weigh, and their joint solution.
//
// In each pass of a substep they are solved together (direct_solve.h) before all contacts are relaxed one by one, which
// finds next to nothing left to do at them. Contacts that hang together through moving bodies make a group, and each
// group is solved by itself, so an island comes out the same in any company.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/solve/contact_blocks.h"
#include "core/physics/solve/direct_solve.h"

namespace tessera::physics {

class DirectContacts {
 public:
  // Groups the contacts that bear. `blocks` holds all of them, prepared.
  void Fill(std::span<const ContactConstraint> contacts, ContactBlocks& blocks, std::span<const SolvedMass> masses);
  void Clear() { groups_.clear(); }

  // A pass with bias, or one without. Where no solution is found, relaxing is left with it all.
  void Solve(ContactBlocks& blocks, std::span<SolvedState> states, const StepConstants& step, bool relax);

  bool empty() const { return groups_.empty(); }
  std::size_t groups() const { return groups_.size(); }

 private:
  struct Group {
    std::vector<std::uint32_t> bodies;  // in the batch, by body of the solve
    std::vector<ContactPlace> places;   // by contact of the solve
    DirectSolve solve;
  };

  std::vector<Group> groups_;
};

}  // namespace tessera::physics
