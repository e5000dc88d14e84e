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
  // One that is ordered no more, or is not due yet, has not failed.
  if (!ordered || newest_ != ordered->tick) failure_.clear();
  if (!ordered || ordered->path.empty() || newest_ == ordered->tick) return;
  const Tick tick = region.tick();
  if (tick < ordered->tick) return;
  newest_ = ordered->tick;
  const bool all_open =
      std::ranges::all_of(region.neighbors(), [&](RegionId neighbor) { return region.IsLinkUp(neighbor); });
  // While a link is down a body may be granted and not taken in: in the states of that tick nobody would own it.
  if (tick == ordered->tick && !writing_ && !region.halted() && all_open) {
    writing_ = true;
    actions.emplace_back(WriteCheckpoint{tick, ordered->path, region.SaveState()});
    return;
  }
  failure_ =
      tick > ordered->tick
          ? absl::StrCat("tick ", ordered->tick.value(), " has passed: it is ", tick.value())
          : std::string("the one before is still being written, a failover is under way, or a border's link is down");
  LogWarning(actions, absl::StrCat("checkpoint missed tick=", ordered->tick.value(), Reason(failure_)));
}

}  // namespace tessera::worker
