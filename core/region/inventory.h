// Inventory: what a region holds when a failover begins, so that for each body the highest epoch can be found.
//
// Thread rule: free functions on values.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/region/body_claim.h"
#include "core/region/region_state.h"
#include "core/world/ids.h"

namespace tessera::region {

// Granted, not acknowledged: the granter still has the state.
struct GrantClaim {
  BodyId body;
  Epoch epoch;  // that goes with the grant
  RegionId to;
  friend auto operator<=>(const GrantClaim&, const GrantClaim&) = default;
};

// A standby's copy of a dead region, as of the last whole tick that came.
struct StandbyCopyInventory {
  RegionId region;
  Incarnation incarnation;
  Tick tick;
  std::vector<BodyClaim> bodies;        // ascending
  std::vector<GrantClaim> grants;       // ascending
  std::vector<BodyClaim> tombstones{};  // ascending
  friend bool operator==(const StandbyCopyInventory&, const StandbyCopyInventory&) = default;
};

struct Inventory {
  MapVersion version;  // names the failover that it answers
  RegionId region;
  Tick tick;                                    // after the last step
  std::vector<BodyClaim> owned;                 // ascending
  std::vector<GrantClaim> grants;               // ascending
  std::vector<StandbyCopyInventory> primaries;  // ascending by region
  std::vector<BodyClaim> tombstones{};          // ascending
  friend bool operator==(const Inventory&, const Inventory&) = default;
};

// INVALID_ARGUMENT naming the list: out of order, a body or epoch 0, a primary that is the region itself.
absl::Status CheckInventory(const Inventory& inventory);

StandbyCopyInventory InventoryOf(const RegionState& state);

}  // namespace tessera::region
