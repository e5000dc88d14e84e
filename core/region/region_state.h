// RegionState: all that carries a region on, as a standby, a checkpoint or a new map needs it.
//
//   absl::StatusOr<RegionState> whole = MergeStates(states);   // states of all regions at one tick
//   config.initial = std::make_shared<RegionState>(*std::move(whole));
//
// Thread rule: free functions on values.
#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/game/host_state.h"
#include "core/region/body_claim.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"
#include "core/region/kept_blast.h"
#include "core/region/pair_reports.h"

namespace tessera::region {

struct StateBody {
  BodyId id;
  Epoch epoch;
  BodyState state;
  friend bool operator==(const StateBody&, const StateBody&) = default;
};

// A body that was granted and that the new owner has not acknowledged: all it takes to promote it.
struct KeptGrant {
  RegionId to;
  Tick tick;  // when the state was so; the new owner has it from the next on
  BodyState state;
  PlayerControl control;               // for a player's body
  std::vector<TouchingPair> touching;  // pairs whose events its owner reports
  CarriedRecord record = {};
  friend bool operator==(const KeptGrant&, const KeptGrant&) = default;
};
using KeptGrants = std::map<std::pair<BodyId, Epoch>, KeptGrant>;  // epoch: of the ownership that was granted

// All that carries a region on: what it owned right after a tick, and what it had promised.
struct RegionState {
  RegionId region;
  Incarnation incarnation;
  Tick tick;
  std::vector<StateBody> bodies;                   // ascending
  std::map<PlayerNumber, PlayerControl> controls;  // for players' bodies among them
  std::vector<PlayerNumber> spawned;               // ascending: whose bodies it has made
  std::vector<TouchingPair> touching;              // ascending: begun and reported, not ended
  KeptGrants grants;
  std::map<BodyId, CarriedRecord> records;  // for bodies among them, where changed
  std::vector<BodyClaim> tombstones;        // ascending, none of the bodies among them
  std::vector<KeptBlast> blasts;            // ascending by id
  game::HostState host;                     // state of the game; empty without one
  friend bool operator==(const RegionState&, const RegionState&) = default;

  const StateBody* Find(BodyId id) const;
  CarriedRecord RecordOf(BodyId id) const;  // empty where nothing was changed
};

// INVALID_ARGUMENT naming the body: one that is not of the scene, a state that is not sane, lists out of order.
absl::Status CheckRegionState(const RegionState& state, const Catalog& catalog);

// All regions' states of one tick as one, of no region and without promises: what regions of any map can begin with
// (Config::initial). A body that two of them have counts with its higher epoch. INVALID_ARGUMENT: none, or different
// ticks.
absl::StatusOr<RegionState> MergeStates(std::span<const RegionState> states);

}  // namespace tessera::region
