// FailoverFollower: carries out the failovers that orders announce.
//
// An order is a whole state and may come twice; each step is taken once:
//
//   failover    the region halts, its links to the dead are cut, nothing is acknowledged to them; the inventory goes up
//   resolution  the region takes its part and goes on (the caller makes it, by TakesPart)
//
//   FailoverFollower failovers(self);
//   failovers.Begin(*order.failover, *order.map, region, copies, links, actions);
//   if (failovers.fenced()) end;
//   if (failovers.TakesPart(*order.resolution)) { region.Resume(...); failovers.Resumed(); }
//
// Thread rule: one thread.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "core/region/inventory.h"
#include "core/region/region.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/identity.h"
#include "region_worker/core/link_table.h"
#include "region_worker/core/order.h"
#include "region_worker/core/standby_copies.h"
#include "tessera/v1/failover.pb.h"

namespace tessera::worker {

class FailoverFollower {
 public:
  explicit FailoverFollower(Identity self) : self_(std::move(self)) {}

  // True if the region has halted for it now. An error is a contradiction that this worker cannot live with: it holds
  // bodies that nobody else may have as well.
  absl::StatusOr<bool> Begin(const OrderedFailover& failover, const PartitionMap& map, region::Region& region,
                             StandbyCopies& copies, LinkTable& links, Actions& actions);
  // It resolves the failover for which the region stands still.
  bool TakesPart(const region::Resolution& resolution) const {
    return inventory_.has_value() && resolution.version == begun_;
  }
  void Resumed(const region::Resolution& resolution, Actions& actions);

  // From the halt until the resolution.
  bool under_way() const { return inventory_.has_value(); }
  // This life of the region was declared dead.
  bool fenced() const { return fenced_; }
  // While a failover is unresolved. Says anew how long ago the dead were acknowledged something.
  std::optional<v1::Inventory> InventoryAt(TimePoint now, const StandbyCopies& copies) const;

 private:
  Identity self_;
  bool fenced_ = false;
  MapVersion begun_;  // names the newest failover
  std::optional<region::Inventory> inventory_;
};

}  // namespace tessera::worker
