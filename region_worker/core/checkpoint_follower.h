// CheckpointFollower: writes the region's state right after the tick that the order names, or says why it cannot.
//
//   CheckpointFollower checkpoints;
//   after each step: checkpoints.Follow(order.checkpoint, region, actions);   // WriteCheckpoint -> Written
//
// Thread rule: one thread.
#pragma once

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "core/region/region.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/order.h"

namespace tessera::worker {

class CheckpointFollower {
 public:
  void Follow(const std::optional<StateFile>& ordered, const region::Region& region, Actions& actions);
  void Written(Tick tick, const absl::Status& status, Actions& actions);

  Tick tick() const { return tick_; }                      // when the newest was written
  const std::string& failure() const { return failure_; }  // why the ordered one cannot be; empty: it has not failed

 private:
  std::optional<Tick> newest_;  // that was begun or missed
  std::optional<Tick> waited_;  // could not be written when it was due
  bool writing_ = false;
  Tick tick_;
  std::string failure_;
};

}  // namespace tessera::worker
