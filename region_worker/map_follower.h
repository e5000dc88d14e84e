// MapFollower: what orders say about who runs what, carried out: failovers and planned maps.
//
// An order is a whole state and may come twice; each step of a change is taken once:
//
//   failover    the region halts, its links to the dead are cut, nothing is acknowledged to them; the inventory goes up
//   resolution  the region takes its part and goes on
//   planned     the map is announced; `committed`: it is to come into force, or the refusal is reported
//
//   MapFollower follower(self, region, links, wards, [&](const auto& resolution) { return ticks.Resume(...); });
//   follower.Follow(order);              // for each order
//   if (follower.MapInForce()) tell clients   // each round
//
// Thread rule: one thread.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/region/region.h"
#include "region_worker/link_port.h"
#include "region_worker/order.h"
#include "region_worker/wards.h"
#include "tessera/v1/failover.pb.h"

namespace tessera::worker {

class MapFollower {
 public:
  // Of a resolution: makes the region go on by it, with the copies of the dead.
  using OnResume =
      std::function<absl::Status(const region::Resolution& resolution, std::span<const region::Standby* const> dead)>;

  MapFollower(Identity self, region::Region& region, LinkPort& links, Wards& wards, OnResume resume);

  // An error is a contradiction that this worker cannot live with: it holds what others must not have twice.
  absl::Status Follow(const Order& order);
  // True once after each change of the map in force.
  bool MapInForce();
  // Neighbours by the map in force and by the one that is announced, the heir, the wards.
  std::vector<RegionId> Partners(const Order& order) const;

  // While a failover is unresolved. Tells anew how long ago the dead were acknowledged something.
  std::optional<v1::Inventory> InventoryAt(TimePoint now) const;
  MapVersion planned() const;  // the newest planned map that is known
  MapVersion refused() const { return refused_; }
  // This life of the region was declared dead.
  bool outranked() const { return outranked_; }

 private:
  absl::Status Begin(const OrderedFailover& failover, const PartitionMap& map);
  absl::Status Resume(const region::Resolution& resolution);
  void Plan(const OrderedMap& planned);

  Identity self_;
  bool outranked_ = false;
  region::Region& region_;
  LinkPort& links_;
  Wards& wards_;
  OnResume resume_;
  MapVersion shown_;  // that clients were told of
  MapVersion begun_;  // of the newest failover
  std::optional<region::Inventory> inventory_;
  MapVersion planned_, refused_;
  Tick planned_tick_;
  std::optional<PartitionMap> next_;  // announced
};

}  // namespace tessera::worker
