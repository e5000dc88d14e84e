#include "region_worker/core/failover_follower.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/region/failover_io.h"

namespace tessera::worker {

absl::StatusOr<bool> FailoverFollower::Begin(const OrderedFailover& failover, const PartitionMap& map,
                                             region::Region& region, StandbyCopies& copies, LinkTable& links,
                                             Actions& actions) {
  if (failover.version <= region.map().version() || failover.version <= begun_) return false;
  const auto is_self = [&](const DeadRegion& dead) {
    return dead.region == self_.region && self_.incarnation <= dead.incarnation;
  };
  if (std::ranges::any_of(failover.dead, is_self)) {
    fenced_ = true;
    return false;
  }
  if (!map.HasRegion(self_.region)) return false;  // it has not joined yet
  for (const DeadRegion& dead : failover.dead) {
    links.Fence(dead.region, dead.incarnation, actions);
    copies.DeclareDead(dead.region);
    LogWarning(actions, absl::StrCat("failover version=", failover.version.value(), " dead=", dead.region.value(),
                                     " incarnation=", dead.incarnation.value()));
  }
  absl::StatusOr<region::Inventory> inventory = region.BeginFailover(map, copies.Dead());
  if (!inventory.ok()) return inventory.status();
  begun_ = failover.version;
  inventory_ = *std::move(inventory);
  LogWarning(actions, absl::StrCat("halted tick=", inventory_->tick.value(), " owned=", inventory_->owned.size(),
                                   " primaries=", inventory_->primaries.size()));
  return true;
}

void FailoverFollower::Resumed(const region::Resolution& resolution, Actions& actions) {
  const auto mine = std::ranges::count(resolution.takeovers, self_.region, &region::Takeover::region);
  LogWarning(actions,
             absl::StrCat("resumed version=", resolution.version.value(), " tick=", resolution.resume_tick.value(),
                          " promoted=", mine, " lost=", resolution.lost.size()));
  inventory_.reset();
}

std::optional<v1::Inventory> FailoverFollower::InventoryAt(TimePoint now, const StandbyCopies& copies) const {
  if (!inventory_) return std::nullopt;
  return region::ToProto(*inventory_, [&](const region::StandbyCopyInventory& primary) {
    const std::optional<TimePoint> acknowledged = copies.AcknowledgedAt(primary.region);
    if (!acknowledged) return std::chrono::milliseconds::max();
    return std::chrono::duration_cast<std::chrono::milliseconds>(now - *acknowledged);
  });
}

}  // namespace tessera::worker
