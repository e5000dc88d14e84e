// Resolve: who goes on with what when regions have died.
//
// For each body the highest epoch lives. A live owner keeps what it has. A body that only the standby of a dead region
// holds is promoted by the standby, unless somebody has removed it since; one that was granted to a dead region, and
// that neither the dead region's standby nor anybody else has, is promoted by its granter. Every promoted body gets an
// epoch that nobody has seen.
//
//   absl::StatusOr<Resolution> resolution = Resolve(map, dead, inventories, expected);
//   send to every live region: region.Resume(*resolution, primaries)
//
// The same input gives the same resolution, whatever the order of the inventories. Thread rule: free functions on
// values.
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/region/inventory.h"
#include "core/world/partition_map.h"

namespace tessera::region {

struct Takeover {
  BodyId body;
  Epoch epoch;              // that the new owner begins with
  RegionId region;          // promotes it
  RegionId from;            // the dead region out of whose standby; 0: out of its own unacknowledged grants
  bool from_grant = false;  // out of unacknowledged grants (its own, or those in the standby) rather than bodies
  friend auto operator<=>(const Takeover&, const Takeover&) = default;
};

// A grant whose new owner has the body and is still to acknowledge it; the granter keeps its copy until then, so that
// the next death finds it.
struct PendingGrant {
  BodyId body;
  Epoch epoch;       // epoch that the owner has now
  RegionId granter;  // the region that keeps a copy
  RegionId to;
  friend auto operator<=>(const PendingGrant&, const PendingGrant&) = default;
};

struct Resolution {
  MapVersion version;  // names the failover
  Tick resume_tick;    // the next tick that is stepped, by all; nobody has used the number of the one before it
  std::vector<Takeover> takeovers;     // ascending
  std::vector<PendingGrant> pending;   // ascending
  std::vector<BodyId> lost;            // ascending: expected, and held by nobody
  std::vector<RegionId> without_copy;  // ascending: dead regions of which nobody has a whole tick
  std::vector<PlayerNumber> players;   // ascending: whose bodies live
  friend bool operator==(const Resolution&, const Resolution&) = default;
};

// `map` is the failover's: its regions are those that live. `expected`: the bodies that there should be, ascending;
// empty if not known. INVALID_ARGUMENT: an inventory of another version or of a region that does not live, two of one
// region, one missing, or one that CheckInventory refuses.
absl::StatusOr<Resolution> Resolve(const PartitionMap& map, std::span<const RegionId> dead,
                                   std::span<const Inventory> inventories, std::span<const BodyId> expected = {});

// INVALID_ARGUMENT naming the list: out of order, a body, epoch or region 0, a body that two promote.
absl::Status CheckResolution(const Resolution& resolution);

}  // namespace tessera::region
