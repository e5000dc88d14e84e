#include "core/region/inventory.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace tessera::region {
namespace {

absl::Status Bad(const std::string& list, const char* what) {
  return absl::InvalidArgumentError(absl::StrCat(list, ": ", what));
}

template <class Claim>
absl::Status CheckClaims(const std::string& list, const std::vector<Claim>& claims) {
  for (std::size_t i = 0; i < claims.size(); ++i) {
    if (claims[i].body == BodyId()) return Bad(list, "body 0");
    if (claims[i].epoch == Epoch()) return Bad(list, "epoch 0");
    if (i > 0 && !(claims[i - 1] < claims[i])) return Bad(list, "not ascending");
  }
  return absl::OkStatus();
}

absl::Status CheckOnce(const std::string& list, const std::vector<BodyClaim>& claims) {
  const auto same = [](const BodyClaim& a, const BodyClaim& b) { return a.body == b.body; };
  if (std::adjacent_find(claims.begin(), claims.end(), same) != claims.end()) return Bad(list, "a body twice");
  return absl::OkStatus();
}

absl::Status CheckHoldings(const std::string& name, const std::vector<BodyClaim>& bodies,
                           const std::vector<GrantClaim>& grants, const std::vector<BodyClaim>& tombstones) {
  if (absl::Status status = CheckClaims(name + "tombstones", tombstones); !status.ok()) return status;
  if (absl::Status status = CheckOnce(name + "tombstones", tombstones); !status.ok()) return status;
  if (absl::Status status = CheckClaims(name + "bodies", bodies); !status.ok()) return status;
  if (absl::Status status = CheckOnce(name + "bodies", bodies); !status.ok()) return status;
  return CheckClaims(name + "grants", grants);
}

}  // namespace

absl::Status CheckInventory(const Inventory& inventory) {
  if (inventory.region == RegionId()) return Bad("region", "must not be 0");
  if (absl::Status status = CheckHoldings("", inventory.owned, inventory.grants, inventory.tombstones); !status.ok())
    return status;
  RegionId last;
  for (const StandbyCopyInventory& primary : inventory.primaries) {
    if (primary.region <= last) return Bad("primaries", "not ascending by region");
    if (primary.region == inventory.region) return Bad("primaries", "the region itself");
    last = primary.region;
    const std::string name = absl::StrCat("primary ", primary.region.value(), ": ");
    if (absl::Status status = CheckHoldings(name, primary.bodies, primary.grants, primary.tombstones); !status.ok()) {
      return status;
    }
  }
  return absl::OkStatus();
}

StandbyCopyInventory InventoryOf(const RegionState& state) {
  StandbyCopyInventory primary{state.region, state.incarnation, state.tick, {}, {}, state.tombstones};
  primary.bodies.reserve(state.bodies.size());
  for (const StateBody& body : state.bodies) primary.bodies.push_back({body.id, body.epoch});
  primary.grants.reserve(state.grants.size());
  for (const auto& [key, grant] : state.grants) primary.grants.push_back({key.first, key.second, grant.to});
  return primary;
}

}  // namespace tessera::region
