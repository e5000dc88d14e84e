// Standby: a standby's copy of one region, a whole tick at a time.
//
//   Standby standby(RegionId(3), region.catalog());
//   if (absl::Status status = standby.Receive(bytes); status.ok()) acknowledge(standby.tick());
//   else ask_for_a_whole_state();                      // a gap, damage
//
// Promise: what it holds is what the region was right after `tick()`, to the bit, or nothing. A message that does not
// follow, or is damaged, leaves it as it was. Thread rule: one thread at a time.
#pragma once

#include <span>

#include "absl/status/status.h"
#include "core/region/log.h"

namespace tessera::region {

class StandbyCopy {
 public:
  // `catalog` must outlive it.
  StandbyCopy(RegionId region, const Catalog& catalog) : catalog_(&catalog) { state_.region = region; }

  RegionId region() const { return state_.region; }
  Incarnation incarnation() const { return state_.incarnation; }
  bool whole() const { return whole_; }  // holds a state
  Tick tick() const { return state_.tick; }
  const RegionState& state() const { return state_; }
  // A message of the region's log. A whole state is taken from the same or a later life of the region, changes only on
  // top of the tick that they are against. A message that is here already is ignored.
  absl::Status Receive(std::span<const std::uint8_t> message);

 private:
  const Catalog* catalog_;
  bool whole_ = false;
  RegionState state_;
};

}  // namespace tessera::region
