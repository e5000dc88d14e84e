// The tick log: what a region tells its heir about each tick, and the state that both ends then have.
//
// A message holds either a whole state or the changes since the tick before, to the last bit; a body that sleeps costs
// nothing. It ends in a checksum. A message with a whole state is also the file that a checkpoint keeps of a region.
// docs/protocol.md describes the bytes.
//
//   LogWriter writer(tick_s);                       // owner: one message a tick
//   send(writer.Write(state of this tick));
//   Standby standby(region, catalog);               // heir: standby.h
//
// Thread rule: one thread at a time; free functions on values.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"
#include "core/region/pair_reports.h"
#include "core/region/region.h"

namespace tessera::region {

struct StateBody {
  BodyId id;
  Epoch epoch;
  BodyState state;
  friend bool operator==(const StateBody&, const StateBody&) = default;
};

// A body that was granted and that the new owner has not confirmed: all it takes to revive it.
struct KeptGrant {
  RegionId to;
  Tick tick;  // of the state; the new owner has it from the next on
  BodyState state;
  PlayerControl control;               // of a player's body
  std::vector<TouchingPair> touching;  // whose events its owner reports
  friend bool operator==(const KeptGrant&, const KeptGrant&) = default;
};
using KeptGrants = std::map<std::pair<BodyId, Epoch>, KeptGrant>;  // epoch: of the ownership that was granted

// All that carries a region on: what it owned right after a tick, and what it had promised.
struct RegionState {
  RegionId region;
  Incarnation incarnation;
  Tick tick;
  std::vector<StateBody> bodies;                   // ascending
  std::map<PlayerNumber, PlayerControl> controls;  // of players' bodies among them
  std::vector<PlayerNumber> spawned;               // ascending: whose bodies it has made
  std::vector<TouchingPair> touching;              // ascending: begun and told, not ended
  KeptGrants grants;
  friend bool operator==(const RegionState&, const RegionState&) = default;

  const StateBody* Find(BodyId id) const;
};

// INVALID_ARGUMENT naming the body: one that is not of the scene, a state that is not sane, lists out of order.
absl::Status CheckRegionState(const RegionState& state, const Catalog& catalog);

// A whole state as a message.
Bytes EncodeState(const RegionState& state);
// The other way; checked as above. DATA_LOSS when the checksum does not match or the bytes end early, INVALID_ARGUMENT
// for what is well summed and wrong.
absl::StatusOr<RegionState> DecodeState(std::span<const std::uint8_t> bytes, const Catalog& catalog);

// What of a region a message is made from.
struct LogView {
  RegionId region;
  Incarnation incarnation;
  Tick tick;
  std::span<const OwnedBody> owned;  // ascending
  std::map<PlayerNumber, PlayerControl> controls;
  std::vector<PlayerNumber> spawned;
  std::span<const PairChange> pair_changes;  // since the last message; unused for a whole state
  const KeptGrants* grants = nullptr;
};

// All regions' states of one tick as one, of no region and without promises: what regions of any map can begin with
// (Config::initial). A body that two of them have counts with its higher epoch. INVALID_ARGUMENT: none, or different
// ticks.
absl::StatusOr<RegionState> MergeStates(std::span<const RegionState> states);

// Owner's end: knows what it wrote last.
class LogWriter {
 public:
  explicit LogWriter(double tick_s) : tick_s_(tick_s) {}

  // The next message is a whole state.
  void Restart() { whole_ = true; }
  bool whole() const { return whole_; }
  // `touching` counts only for a whole state.
  Bytes Write(const LogView& now, std::span<const TouchingPair> touching);

 private:
  Bytes WriteChanges(const LogView& now);

  const double tick_s_;
  bool whole_ = true;
  RegionState last_;  // touching is left empty
};

// The tick, region and kind of a message, without looking further.
struct LogHeader {
  bool whole = false;
  RegionId region;
  Incarnation incarnation;
  Tick tick, base;  // base: the tick that changes are against
};
absl::StatusOr<LogHeader> DecodeLogHeader(std::span<const std::uint8_t> bytes);

// Heir's end: brings `state` on by one message of changes against it, or leaves it as it was. FAILED_PRECONDITION for
// a message against another tick, or of another region or life.
absl::Status ApplyChanges(std::span<const std::uint8_t> bytes, const Catalog& catalog, RegionState& state);

}  // namespace tessera::region
