#include "region_worker/core/map_follower.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "region_worker/core/reason.h"

namespace tessera::worker {

void MapFollower::Follow(const OrderedMap& planned, bool stands, region::Region& region, Actions& actions) {
  const MapVersion version = planned.map.version();
  if (version <= region.map().version()) return;
  Announce(planned, region, actions);
  if (!planned.committed || planned_ != version || refused_ == version || region.committed()) return;
  const absl::Status committed = region.Commit(version, stands);
  if (committed.ok()) {
    LogInfo(actions, absl::StrCat("map committed version=", version.value(), " effective=", planned.effective.value(),
                                  " tick=", region.tick().value()));
  } else {
    LogWarning(actions, absl::StrCat("map refused version=", version.value(), Reason(committed)));
    refused_ = version;
  }
}

void MapFollower::Announce(const OrderedMap& planned, region::Region& region, Actions& actions) {
  const MapVersion version = planned.map.version();
  const bool is_new = version > planned_ || (version == planned_ && planned.effective != planned_tick_);
  if (!is_new) return;
  const absl::Status announced = region.Announce(planned.map, planned.effective);
  if (announced.ok()) {
    LogInfo(actions, absl::StrCat("map announced version=", version.value(), " effective=", planned.effective.value()));
    planned_ = version;
    planned_tick_ = planned.effective;
    next_ = planned.map;
  } else if (refused_ < version) {
    LogWarning(actions, absl::StrCat("map not announced version=", version.value(), Reason(announced)));
    refused_ = version;
  }
}

bool MapFollower::CameIntoForce(const region::Region& region, Actions& actions) {
  const MapVersion version = region.map().version();
  if (version == in_force_) return false;
  in_force_ = version;
  if (next_ && next_->version() <= version) next_.reset();
  LogInfo(actions, absl::StrCat("map in force version=", version.value(), " tick=", region.tick().value()));
  return true;
}

MapVersion MapFollower::planned(const region::Region& region) const {
  return std::max(planned_, region.map().version());
}

}  // namespace tessera::worker
