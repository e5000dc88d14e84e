// MapFollower: brings a region to the maps that its orders plan.
//
// An order is a whole state and may come twice; each step is taken once: a planned map is announced; once it is
// `committed` it is to come into force, or the refusal is reported.
//
//   MapFollower maps(region);
//   maps.Follow(*order.planned, stands, region, actions);  // each order, unless a failover is under way
//   if (maps.CameIntoForce(region, actions)) publish it   // each round
//
// Thread rule: one thread.
#pragma once

#include <optional>

#include "core/region/region.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/order.h"

namespace tessera::worker {

class MapFollower {
 public:
  explicit MapFollower(const region::Region& region) : in_force_(region.map().version()) {}

  // `stands`: by the pause that is in force here, which a committed map ends.
  void Follow(const OrderedMap& planned, bool stands, region::Region& region, Actions& actions);
  // A failover's map takes the place of the one that is announced.
  void ForgetNext() { next_.reset(); }
  // True once after each change of the map in force.
  bool CameIntoForce(const region::Region& region, Actions& actions);

  // The announced map, until it is in force.
  const std::optional<PartitionMap>& next() const { return next_; }
  MapVersion planned(const region::Region& region) const;  // the newest planned map that is known
  MapVersion refused() const { return refused_; }

 private:
  void Announce(const OrderedMap& planned, region::Region& region, Actions& actions);

  MapVersion in_force_;
  MapVersion planned_, refused_;
  Tick planned_tick_;
  std::optional<PartitionMap> next_;
};

}  // namespace tessera::worker
