// Failover: a region's part in carrying on after the death of others: it halts, says what it holds, and learns who
// promotes which body.
//
// Thread rule: one thread at a time; the free functions work on values.
#pragma once

#include <map>
#include <optional>
#include <span>

#include "absl/status/status.h"
#include "core/region/catalog.h"
#include "core/region/inventory.h"
#include "core/region/pair_reports.h"
#include "core/region/region_state.h"
#include "core/region/resolve.h"
#include "core/region/standby_copy.h"
#include "core/world/partition_map.h"

namespace tessera::region {

class Failover {
 public:
  // Begun and not ended: nothing is stepped.
  bool under_way() const { return map_.has_value(); }
  // Begins with the failover's map, or starts over with a newer one; the same again changes nothing.
  // FAILED_PRECONDITION: a map that is not newer than the one in force, or that of the failover under way. `begun` says
  // whether anything changed.
  absl::Status Begin(const PartitionMap& map, MapVersion in_force, bool* begun);
  // Whether this resolution can end it at tick `now`: FAILED_PRECONDITION for the resolution of another failover or of
  // a tick that has passed, INVALID_ARGUMENT for what CheckResolution refuses.
  absl::Status Check(const Resolution& resolution, Tick now) const;
  // Ends it: its map comes into force.
  PartitionMap End();

  void Validate(MapVersion in_force) const;

 private:
  std::optional<PartitionMap> map_;
};

// All that a region holds: its own state, and the copies of dead primaries.
Inventory TakeInventory(const RegionState& own, MapVersion version, std::span<const StandbyCopy* const> primaries);

// Copies of the bodies that this region is to promote, by body. FAILED_PRECONDITION naming a body that is not here.
absl::StatusOr<std::map<BodyId, KeptGrant>> FindPromoted(const Resolution& resolution, RegionId self,
                                                         const KeptGrants& kept,
                                                         std::span<const StandbyCopy* const> primaries,
                                                         const Catalog& catalog, const PairReports& reports);

// Copies that this region still has to keep as a granter, its own or those of its dead primaries: their new owners have
// not acknowledged them, and the next death may need them.
KeptGrants FindStillNeeded(const Resolution& resolution, RegionId self, const KeptGrants& kept,
                           std::span<const StandbyCopy* const> primaries);

}  // namespace tessera::region
