// Impacts: restitution, for contacts that have any.
//
// Before a substep is solved, blows are struck one by one in the order of their times within it: each at the moment
// when its point reaches the surface, with the velocities that its bodies have by then, and each moves the times of
// those to come of the same two bodies (see strike.h). A ball keeps its energy with e = 1; a column of balls that lands
// hands its blows up and down within one substep as it should; a row of touching balls hands a blow on to the last one.
// The solver finds nothing left to do.
//
// Most contacts are not about to hit: a wide kernel picks out the few that approach.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/solve/contact_blocks.h"
#include "core/physics/solve/strike.h"

namespace tessera::physics {

class Impacts {
 public:
  // Finds the bodies that may bounce. After the bodies come `worlds` that stand for the world. Contacts must outlive
  // the substeps.
  void Fill(std::span<const ContactConstraint> contacts, std::size_t bodies, std::size_t worlds);
  // Bounces, after the kick of each substep; `before` are the velocities before it. Returns whether any body was moved.
  bool Bounce(const Kernels& kernels, ContactBlocks& blocks, SolvedState* states, const SolvedMass* masses,
              SolvedMemory* before, const SolvedKick* kicks, float h);

  bool empty() const { return bodies_.empty(); }

 private:
  // The next blow of a contact.
  struct Blow {
    float from = 0;              // the two fly as they do since this time, s
    std::uint32_t foreseen = 0;  // number of times that it was; only the last one counts
    int struck = 0;              // number of blows in this substep
  };
  // A blow that was foreseen.
  struct Event {
    float time;
    std::uint32_t contact, foreseen;
    bool operator<(const Event& other) const {  // the first in time comes first in a heap
      return time != other.time ? time > other.time : contact > other.contact;
    }
  };

  bool FindPaths(SolvedState* states, const SolvedMass* masses, const SolvedMemory* before, const SolvedKick* kicks,
                 float h);
  void Connect(const ContactBlocks& blocks);
  void ForeseeAll(const Kernels& kernels, ContactBlocks& blocks, const StruckBodies& bodies);
  void Foresee(ContactBlocks& blocks, const StruckBodies& bodies, std::uint32_t contact, float from);
  void ForeseeOthers(ContactBlocks& blocks, const StruckBodies& bodies, std::uint32_t body, const Event& event);
  void StrikeAll(ContactBlocks& blocks, const StruckBodies& bodies);
  void Forget();

  std::span<const ContactConstraint> contacts_;
  std::vector<std::uint32_t> bodies_;  // those with such contacts, each once
  std::vector<bool> listed_;           // by body
  std::vector<Vec3f> shifts_;          // by body, m, and of those that stand for the world
  std::vector<Setback> setbacks_;      // likewise
  std::vector<Pushed> pushes_;         // likewise

  bool connected_ = false;              // the following are filled, for the contacts at hand
  std::vector<Blow> blows_;             // by contact
  std::vector<std::uint32_t> at_slot_;  // contact by slot, a lane of a block
  std::vector<std::uint32_t> first_;    // by body: the last contact of those that bounce, or none
  std::vector<std::uint32_t> next_;     // two a contact, of its a and its b: the contact of that body before it

  std::vector<std::uint8_t> lanes_;      // contacts that approach, by block of a run
  std::vector<std::uint32_t> foreseen_;  // contacts whose blow was, in this substep
  std::vector<Event> events_;            // a heap
};

}  // namespace tessera::physics
