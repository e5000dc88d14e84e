// SharedProperties: the properties of bodies near borders, as neighbours see them, and those of the neighbours' bodies.
//
// A game reads properties of every body that its region sees. Those of a neighbour's body come with the neighbour's
// frames: a body that comes into sight with all that were changed, later on what was changed again. A change is shown
// kDelay ticks after it was made, so that every run of a world shows it in the same tick, or later once the standby has
// it: nobody reads what a death could take back. A world without a game shows nothing.
//
//   shared.Changed(body, before, after, tick);                    // own bodies
//   frame.properties = shared.For(neighbour, frame.ghosts, records);
//   shared.Take(frame.properties);  shared.KeepOnly(ghosts);      // the neighbours'
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/region/bodies.h"
#include "core/region/frame.h"
#include "core/region/record_table.h"

namespace tessera::region {

class SharedProperties {
 public:
  // Ticks from a change to the first frame that has it; it is read a tick later.
  static constexpr std::uint64_t kDelay = 3;

  // --- Own bodies.
  // `before` is null where the body had no record. The log of `tick` is the first that has the change.
  void Changed(const KeptRecord* before, const KeptRecord& after, Tick tick);
  // The body is not owned here any more.
  void Left(BodyId id) { pending_.erase(id); }
  // Whether a change is still to be shown.
  bool waits() const { return !pending_.empty(); }
  // After the step to `now`: no death of this region alone takes back what was so at `committed`.
  void Release(Tick committed, Tick now);
  // Those that a frame with these ghosts, ascending, has to tell this neighbour: what it was not told before.
  std::vector<GhostProperties> For(RegionId to, std::span<const GhostRecord> ghosts, const RecordTable& records);
  // The neighbour lost what it was told.
  void Forget(RegionId to) { told_.erase(to); }
  // Another map is in force: those that stay keep what they were told, unless `anew`.
  void SetNeighbors(std::span<const RegionId> neighbors, bool anew);

  // --- The neighbours' bodies.
  void Take(std::span<const GhostProperties> properties);
  // An own body is a neighbour's from now on, which has all of its record.
  void GoesOnAsGhost(const KeptRecord& record) { seen_[record.body] = record.bytes; }
  // The others are not seen any more. `ghosts` ascend.
  void KeepOnly(std::span<const Ghost> ghosts);
  // PropertySet::Encode; null where nothing is known to differ from the scene.
  const std::vector<std::uint8_t>* Find(BodyId id) const;

  void Validate(const Bodies& bodies) const;

 private:
  struct Pending {
    PropertyPointer shown;
    std::deque<std::pair<Tick, PropertyPointer>> later;  // ascending
  };
  const PropertyPointer& ShownOf(const KeptRecord& record) const;

  std::map<BodyId, Pending> pending_;
  std::map<RegionId, std::map<BodyId, PropertyPointer>> told_;  // properties of the ghosts in the last frame
  std::map<BodyId, PropertyPointer> seen_;
};

}  // namespace tessera::region
