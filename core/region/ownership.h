// Ownership: a body that a region owns, together with all that goes with it: the steering of a player's body, the
// properties that were changed, the touching pairs whose events its owner reports, and what of it nobody may know yet.
//
// Promise: bodies come to be owned here, and cease to be, through this class alone; so each of the five tables has an
// entry for a body exactly if the body is owned and has something to enter. Thread rule: one thread at a time.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/region/blast_table.h"
#include "core/region/bodies.h"
#include "core/region/departing_body.h"
#include "core/region/grants_out.h"
#include "core/region/handover.h"
#include "core/region/output_commit.h"
#include "core/region/pair_reports.h"
#include "core/region/record_table.h"
#include "core/region/region_players.h"
#include "core/region/region_state.h"
#include "core/region/shared_properties.h"
#include "core/region/step_result.h"

namespace tessera::region {

class Ownership {
 public:
  // All must outlive it.
  Ownership(const Catalog& catalog, Bodies& bodies, RegionPlayers& players, PairReports& reports, RecordTable& records,
            OutputCommit& output, SharedProperties& shared, BlastTable& blasts)
      : catalog_(catalog),
        bodies_(bodies),
        players_(players),
        reports_(reports),
        records_(records),
        output_(output),
        shared_(shared),
        blasts_(blasts) {}

  // --- A body comes. Its touching pairs are adopted apart: a grant has them for a whole assembly.
  void Take(const GrantedBody& body, const PlayerControl& control);
  // The same for a body of a saved state, whose contacts nobody remembers.
  void Restore(const GrantedBody& body, const PlayerControl& control);
  void Spawn(PlayerNumber player, const PropertySet& begins = {});
  // The definition of an owned body changes as a game asks.
  void Tune(BodyId id, const BodyTuning& tuning) { bodies_.Tune(id, tuning); }
  // The record of the world, where the world begins.
  void BeginInstance() { bodies_.OwnBodiless(kInstanceBody, Epoch(1), InstanceState(catalog_)); }
  // One that a game made.
  void Spawn(BodyId id, const BodyState& state) { bodies_.Own(id, Epoch(1), state); }
  // A body that is owned is there from now on.
  void Place(BodyId id, const BodyState& state) { bodies_.Place(id, state); }

  // --- A body goes.
  struct HandedOver {
    Departure departure;
    std::vector<PlayerInput> late_inputs;  // came after the grant
  };
  // It lives on as a ghost of the new owner's.
  HandedOver HandOver(const DepartingBody& body);
  // It is taken out of the world, and its pairs end.
  Departure Remove(BodyId id);
  // The same for a body that still has messages under way: they are left, with its id and epoch, until
  // `RemoveBodiless`.
  Departure Retire(BodyId id);
  // Nothing is left of a body that was removed. Returns the epoch that it had.
  Epoch RemoveBodiless(BodyId id);
  // The same for bodies whose states came out of the last step not finite, or beyond limits; reads all other states.
  std::vector<Departure> ReadBack();
  // It is taken out of the world because `to` owns it: its pairs go on there.
  Departure LetGo(BodyId id, RegionId to);

  // --- What is owned, for others.
  // Prepares the handover of an assembly after the step to `tick`.
  PreparedGrant Prepare(const PlannedHandover& planned, Tick tick);
  // Fills in the bodies, and all that goes with them.
  void Save(RegionState& state) const;

  void Validate() const;

 private:
  std::vector<PlayerInput> Release(BodyId id);
  void Enter(const GrantedBody& body, const PlayerControl& control, bool restored);
  static BodyState InstanceState(const Catalog& catalog);

  const Catalog& catalog_;
  Bodies& bodies_;
  RegionPlayers& players_;
  PairReports& reports_;
  RecordTable& records_;
  OutputCommit& output_;
  SharedProperties& shared_;
  BlastTable& blasts_;
};

}  // namespace tessera::region
