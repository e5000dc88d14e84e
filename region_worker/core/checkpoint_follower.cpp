#include "region_worker/core/checkpoint_follower.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "region_worker/core/reason.h"

namespace tessera::worker {

void CheckpointFollower::Written(Tick tick, const absl::Status& status, Actions& actions) {
  writing_ = false;
  if (status.ok()) {
    tick_ = tick;
    return;
  }
  failure_ = std::string(status.message());
  LogError(actions, absl::StrCat("checkpoint failed tick=", tick.value(), Reason(failure_)));
}

void CheckpointFollower::Follow(const std::optional<StateFile>& ordered, const region::Region& region,
                                Actions& actions) {
  // A region that stands may be asked for the same tick again.
  if (!ordered && !failure_.empty()) newest_.reset();
  // One that is ordered no more, or is not due yet, has not failed.
  if (!ordered || newest_ != ordered->tick) failure_.clear();
  if (!ordered || ordered->path.empty() || newest_ == ordered->tick) return;
  const Tick tick = region.tick();
  if (tick < ordered->tick) return;
  const bool all_open =
      std::ranges::all_of(region.neighbors(), [&](RegionId neighbor) { return region.IsLinkUp(neighbor); });
  // While a link is down a body may be granted and not taken in: in the states of that tick nobody would own it.
  const bool can = !writing_ && !region.halted() && all_open;
  if (tick == ordered->tick && !can) {
    waited_ = ordered->tick;  // a region that stands after it may write it yet
    return;
  }
  newest_ = ordered->tick;
  if (tick == ordered->tick) {
    writing_ = true;
    actions.emplace_back(WriteCheckpoint{tick, ordered->path, region.SaveState()});
    return;
  }
  failure_ =
      waited_ == ordered->tick
          ? std::string("the one before was still being written, a failover was under way, or a border's link was down")
          : absl::StrCat("tick ", ordered->tick.value(), " has passed: it is ", tick.value());
  LogWarning(actions, absl::StrCat("checkpoint missed tick=", ordered->tick.value(), Reason(failure_)));
}

}  // namespace tessera::worker
