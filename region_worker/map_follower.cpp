#include "region_worker/map_follower.h"

#include <algorithm>
#include <set>

#include "core/region/failover_io.h"
#include "core/region/inventory.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"

namespace tessera::worker {
namespace {

std::string Reason(const absl::Status& status) { return telemetry::LogValue(std::string(status.message())); }

}  // namespace

MapFollower::MapFollower(Identity self, region::Region& region, LinkPort& links, Wards& wards, OnResume resume)
    : self_(std::move(self)),
      region_(region),
      links_(links),
      wards_(wards),
      resume_(std::move(resume)),
      shown_(region.map().version()) {}

absl::Status MapFollower::Follow(const Order& order) {
  if (order.failover && order.failover->version > region_.map().version() && order.failover->version > begun_) {
    if (absl::Status begun = Begin(*order.failover, *order.map); !begun.ok()) return begun;
  }
  if (order.resolution && inventory_ && order.resolution->version == begun_) {
    if (absl::Status resumed = Resume(*order.resolution); !resumed.ok()) return resumed;
  }
  if (order.planned && !inventory_) Plan(*order.planned);
  return absl::OkStatus();
}

absl::Status MapFollower::Begin(const OrderedFailover& failover, const PartitionMap& map) {
  const auto is_self = [&](const DeadRegion& dead) {
    return dead.region == self_.region && self_.incarnation <= dead.incarnation;
  };
  if (std::any_of(failover.dead.begin(), failover.dead.end(), is_self)) {
    outranked_ = true;
    return absl::OkStatus();
  }
  const auto regions = map.regions();
  const auto is_mine = [&](const MapRegion& region) { return region.id == self_.region; };
  if (std::none_of(regions.begin(), regions.end(), is_mine)) return absl::OkStatus();  // it has not joined yet
  for (const DeadRegion& dead : failover.dead) {
    links_.Outrank(dead.region, dead.incarnation);
    wards_.DeclareDead(dead.region);
    spdlog::warn("failover version={} dead={} incarnation={}", failover.version.value(), dead.region.value(),
                 dead.incarnation.value());
  }
  absl::StatusOr<region::Inventory> inventory = region_.BeginFailover(map, wards_.Dead());
  if (!inventory.ok()) return inventory.status();
  begun_ = failover.version;
  inventory_ = *std::move(inventory);
  next_.reset();
  spdlog::warn("halted tick={} owned={} wards={}", inventory_->tick.value(), inventory_->owned.size(),
               inventory_->wards.size());
  return absl::OkStatus();
}

absl::Status MapFollower::Resume(const region::Resolution& resolution) {
  if (absl::Status resumed = resume_(resolution, wards_.Dead()); !resumed.ok()) return resumed;
  const auto mine = std::count_if(resolution.takeovers.begin(), resolution.takeovers.end(),
                                  [&](const region::Takeover& takeover) { return takeover.region == self_.region; });
  spdlog::warn("resumed version={} tick={} taken_up={} lost={}", resolution.version.value(),
               resolution.resume_tick.value(), mine, resolution.lost.size());
  wards_.Forget();
  inventory_.reset();
  return absl::OkStatus();
}

void MapFollower::Plan(const OrderedMap& planned) {
  const MapVersion version = planned.map.version();
  if (version <= region_.map().version()) return;
  if (version > planned_ || (version == planned_ && planned.effective != planned_tick_)) {
    const absl::Status announced = region_.Announce(planned.map, planned.effective);
    if (announced.ok()) {
      spdlog::info("map announced version={} effective={}", version.value(), planned.effective.value());
      planned_ = version;
      planned_tick_ = planned.effective;
      next_ = planned.map;
    } else if (refused_ < version) {
      spdlog::warn("map not announced version={} reason={}", version.value(), Reason(announced));
      refused_ = version;
      return;
    }
  }
  if (!planned.committed || planned_ != version || refused_ == version || region_.committed()) return;
  const absl::Status committed = region_.Commit(version);
  if (committed.ok()) {
    spdlog::info("map committed version={} effective={} tick={}", version.value(), planned.effective.value(),
                 region_.tick().value());
  } else {
    spdlog::warn("map refused version={} reason={}", version.value(), Reason(committed));
    refused_ = version;
  }
}

bool MapFollower::MapInForce() {
  const MapVersion version = region_.map().version();
  if (version == shown_) return false;
  shown_ = version;
  links_.SetMapVersion(version);
  if (next_ && next_->version() <= version) next_.reset();
  spdlog::info("map in force version={} tick={}", version.value(), region_.tick().value());
  return true;
}

std::vector<RegionId> MapFollower::Partners(const Order& order) const {
  std::set<RegionId> all;
  const auto add = [&](std::span<const RegionId> regions) { all.insert(regions.begin(), regions.end()); };
  add(region_.neighbors());
  if (next_) add(next_->Neighbors(self_.region));
  // A failover's map is in force only after its resolution; the links are there by then.
  if (inventory_ && order.map) add(order.map->Neighbors(self_.region));
  if (order.heir != RegionId()) all.insert(order.heir);
  add(order.wards);
  return {all.begin(), all.end()};
}

std::optional<v1::Inventory> MapFollower::InventoryAt(TimePoint now) const {
  if (!inventory_) return std::nullopt;
  return region::ToProto(*inventory_, [&](const region::WardInventory& ward) {
    const auto found = wards_.all().find(ward.region);
    if (found == wards_.all().end()) return std::chrono::milliseconds::max();
    return std::chrono::duration_cast<std::chrono::milliseconds>(now - found->second.acknowledged_at);
  });
}

MapVersion MapFollower::planned() const { return std::max(planned_, region_.map().version()); }

}  // namespace tessera::worker
