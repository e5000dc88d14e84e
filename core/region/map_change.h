// MapChange: a planned map on its way: announced, committed, due.
//
// A commit that one region accepts reaches all others through the headers of frames, one link a tick, before the tick
// at which the map comes into force; a region that is asked too late for that refuses. So either all change at that
// tick or none does, and nobody waits. Thread rule: one thread at a time.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "core/world/partition_map.h"

namespace tessera::region {

class MapChange {
 public:
  // As Region::Announce. `in_force` is what the region goes by at tick `now`.
  absl::Status Announce(const PartitionMap& map, Tick effective, MapVersion in_force, Tick now);
  // As Region::Commit. `hops`: how many ticks a header takes to reach everyone.
  absl::Status Commit(MapVersion version, Tick now, std::uint64_t hops);
  // A header said that this version is committed. Accepted whenever it comes, even before the announcement.
  void Heard(MapVersion version);
  // Nothing is planned any more: a map came into force, or a failover made it void.
  void Clear() { map_.reset(); }

  MapVersion announced() const { return map_.has_value() ? map_->version() : MapVersion(); }
  const PartitionMap* map() const { return map_.has_value() ? &*map_ : nullptr; }
  Tick effective() const { return effective_; }
  bool committed() const { return map_.has_value() && committed_ >= map_->version(); }
  // The newest version that is known to be committed: what headers say.
  MapVersion newest_commit() const { return committed_; }
  // Whether frames of this tick go by the new map.
  bool DueAt(Tick tick) const { return committed() && tick + 1 >= effective_; }

  // For the end of the step to `now`, by the map that is in force then.
  void Validate(MapVersion in_force, Tick now) const;

 private:
  std::optional<PartitionMap> map_;
  Tick effective_;
  MapVersion committed_;
};

// Links from `region` to the one furthest from it, along which everyone else can be reached.
std::uint64_t FurthestRegion(const PartitionMap& map, RegionId region);

}  // namespace tessera::region
