// The tick log: what a region sends its standby about each tick, and the state that both ends then have.
//
// A message holds either a whole state or the changes since the tick before, to the last bit; a body that sleeps costs
// nothing. It ends in a checksum. A message with a whole state is also the file that a checkpoint keeps of a region.
// docs/protocol.md describes the bytes.
//
//   LogWriter writer(tick_s);                       // owner: one message a tick
//   send(writer.Write(state of this tick));
//   StandbyCopy copy(region, catalog);               // standby: standby_copy.h
//
// Thread rule: one thread at a time; free functions on values.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/region/kept_blast.h"
#include "core/region/owned_body.h"
#include "core/region/region_state.h"
#include "core/region/step_result.h"

namespace tessera::region {

// A whole state as a message.
Bytes EncodeState(const RegionState& state);
// The other way; checked as above. DATA_LOSS when the checksum does not match or the bytes end early, INVALID_ARGUMENT
// for what is well summed and wrong.
absl::StatusOr<RegionState> DecodeState(std::span<const std::uint8_t> bytes, const Catalog& catalog);

// The parts of a region that a message is made from.
struct LogView {
  RegionId region;
  Incarnation incarnation;
  Tick tick;
  std::span<const OwnedBody> owned;  // ascending
  std::map<PlayerNumber, PlayerControl> controls;
  std::vector<PlayerNumber> spawned;
  std::span<const PairChange> pair_changes;  // since the last message; unused for a whole state
  const KeptGrants* grants = nullptr;
  // Ascending. For a whole state all, else those that are new since the last message.
  std::span<const KeptRecord> records = {};
  std::vector<BodyClaim> tombstones = {};    // ascending, all
  std::span<const OwnedBody> bodiless = {};  // ascending
  std::span<const KeptBlast> blasts = {};    // ascending, all
  game::HostState host = {};
};

// Owner's end: knows what it wrote last.
class LogWriter {
 public:
  explicit LogWriter(double tick_s) : tick_s_(tick_s) {}

  // The next message is a whole state.
  void Restart() { whole_ = true; }
  bool whole() const { return whole_; }
  Tick tick() const { return last_.tick; }  // that of the last message
  // `touching` counts only for a whole state.
  Bytes Write(const LogView& now, std::span<const TouchingPair> touching);

 private:
  Bytes WriteChanges(const LogView& now);

  const double tick_s_;
  bool whole_ = true;
  RegionState last_;  // touching and records are left empty
};

// The tick, region and kind of a message, without looking further.
struct LogHeader {
  bool whole = false;
  RegionId region;
  Incarnation incarnation;
  Tick tick, base;  // base: the tick that changes are against
};
absl::StatusOr<LogHeader> DecodeLogHeader(std::span<const std::uint8_t> bytes);

// Standby's end: brings `state` on by one message of changes against it, or leaves it as it was. FAILED_PRECONDITION
// for a message against another tick, or of another region or life.
absl::Status ApplyChanges(std::span<const std::uint8_t> bytes, const Catalog& catalog, RegionState& state);

}  // namespace tessera::region
