#include "core/region/resolve.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "absl/strings/str_cat.h"

namespace tessera::region {
namespace {

absl::Status Bad(const std::string& what) { return absl::InvalidArgumentError(what); }

// Where epochs are equal, the first of these lives.
enum class ClaimKind : std::uint8_t { kOwned, kStandby, kGranted, kStandbyGranted };

struct Claim {
  BodyId body;
  Epoch epoch;
  ClaimKind kind = ClaimKind::kOwned;
  RegionId holder;
  RegionId from;  // the dead region out of whose standby; 0: the holder's own
  Tick tick;      // when a standby had it
};

bool Better(const Claim& a, const Claim& b) {
  return std::tuple(a.body, b.epoch, a.kind, b.tick, a.holder, a.from) <
         std::tuple(b.body, a.epoch, b.kind, a.tick, b.holder, b.from);
}

// The copy of each dead region that counts: of its newest life and tick. A region that is standby no more may still
// have an older one. Among equal ones the lowest holder's.
using NewestCopies = std::map<RegionId, std::pair<RegionId, const StandbyCopyInventory*>>;  // by the dead: holder, copy

NewestCopies NewestCopiesOf(std::span<const Inventory> inventories, std::span<const RegionId> dead) {
  NewestCopies newest;
  for (const Inventory& inventory : inventories) {
    for (const StandbyCopyInventory& copy : inventory.primaries) {
      if (std::find(dead.begin(), dead.end(), copy.region) == dead.end()) continue;
      auto& [holder, best] = newest[copy.region];
      const auto age = [](const StandbyCopyInventory& one) { return std::pair(one.incarnation, one.tick); };
      const bool older = best != nullptr && age(copy) < age(*best);
      if (older || (best != nullptr && age(copy) == age(*best) && holder < inventory.region)) continue;
      holder = inventory.region;
      best = &copy;
    }
  }
  return newest;
}

void AddClaims(const Inventory& inventory, const NewestCopies& newest, std::vector<Claim>& claims) {
  const RegionId self = inventory.region;
  for (const auto& [body, epoch] : inventory.owned) {
    claims.push_back({body, epoch, ClaimKind::kOwned, self, RegionId(), Tick()});
  }
  for (const auto& [body, epoch, to] : inventory.grants) {
    claims.push_back({body, epoch, ClaimKind::kGranted, self, RegionId(), Tick()});
  }
  for (const StandbyCopyInventory& primary : inventory.primaries) {
    const auto counts = newest.find(primary.region);
    if (counts == newest.end() || counts->second.second != &primary) continue;
    for (const auto& [body, epoch] : primary.bodies) {
      claims.push_back({body, epoch, ClaimKind::kStandby, self, primary.region, primary.tick});
    }
    for (const auto& [body, epoch, to] : primary.grants) {
      claims.push_back({body, epoch, ClaimKind::kStandbyGranted, self, primary.region, primary.tick});
    }
  }
}

// The epochs up to which bodies were removed: no copy of them counts.
std::map<BodyId, Epoch> TombstonesOf(std::span<const Inventory> inventories, std::span<const RegionId> dead) {
  std::map<BodyId, Epoch> removed;
  const auto add = [&](const std::vector<BodyClaim>& tombstones) {
    for (const auto& [body, epoch] : tombstones) {
      Epoch& highest = removed[body];
      highest = std::max(highest, epoch);
    }
  };
  for (const Inventory& inventory : inventories) {
    add(inventory.tombstones);
    for (const StandbyCopyInventory& primary : inventory.primaries) {
      if (std::find(dead.begin(), dead.end(), primary.region) != dead.end()) add(primary.tombstones);
    }
  }
  return removed;
}

absl::Status CheckAll(const PartitionMap& map, std::span<const Inventory> inventories) {
  std::vector<RegionId> answered;
  for (const Inventory& inventory : inventories) {
    const std::string who = absl::StrCat("inventory of region ", inventory.region.value());
    if (absl::Status status = CheckInventory(inventory); !status.ok()) {
      return Bad(absl::StrCat(who, ": ", status.message()));
    }
    if (inventory.version != map.version()) return Bad(who + ": of another failover");
    answered.push_back(inventory.region);
  }
  std::sort(answered.begin(), answered.end());
  const auto twice = std::adjacent_find(answered.begin(), answered.end());
  if (twice != answered.end()) return Bad(absl::StrCat("two inventories of region ", twice->value()));
  for (const MapRegion& region : map.regions()) {
    if (!std::binary_search(answered.begin(), answered.end(), region.id)) {
      return Bad(absl::StrCat("no inventory of region ", region.id.value()));
    }
  }
  if (answered.size() != map.regions().size()) return Bad("an inventory of a region that is not in the map");
  return absl::OkStatus();
}

Tick NewestTick(std::span<const Inventory> inventories) {
  Tick newest;
  for (const Inventory& inventory : inventories) {
    newest = std::max(newest, inventory.tick);
    for (const StandbyCopyInventory& primary : inventory.primaries) newest = std::max(newest, primary.tick);
  }
  return newest;
}

// `claims`: all on one body, best first.
void Settle(std::span<const Claim> claims, const PartitionMap& map, Resolution& resolution) {
  const Claim& best = claims.front();
  const bool kept = best.kind == ClaimKind::kOwned;
  const Epoch epoch = kept ? best.epoch : Epoch(best.epoch.value() + 1);
  if (!kept) {
    const bool from_grant = best.kind != ClaimKind::kStandby;
    resolution.takeovers.push_back({best.body, epoch, best.holder, best.from, from_grant});
  }
  for (const Claim& claim : claims.subspan(1)) {
    const bool copy = claim.kind == ClaimKind::kGranted || claim.kind == ClaimKind::kStandbyGranted;
    if (!copy || claim.epoch != best.epoch || claim.holder == best.holder) continue;
    const std::vector<RegionId> links = map.Neighbors(claim.holder);
    if (!std::binary_search(links.begin(), links.end(), best.holder)) continue;
    resolution.pending.push_back({best.body, epoch, claim.holder, best.holder});
  }
  if (IsPlayerBody(best.body)) resolution.players.push_back(PlayerOf(best.body));
}

void FindLost(std::span<const BodyId> expected, std::span<const Claim> claims, const std::map<BodyId, Epoch>& removed,
              Resolution& resolution) {
  auto claim = claims.begin();
  for (const BodyId id : expected) {
    while (claim != claims.end() && claim->body < id) ++claim;
    if ((claim == claims.end() || claim->body != id) && !removed.contains(id)) resolution.lost.push_back(id);
  }
}

template <class List>
absl::Status CheckAscending(const List& list, const char* name) {
  for (std::size_t i = 1; i < list.size(); ++i) {
    if (!(list[i - 1] < list[i])) return Bad(absl::StrCat(name, ": not ascending"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Resolution> Resolve(const PartitionMap& map, std::span<const RegionId> dead,
                                   std::span<const Inventory> inventories, std::span<const BodyId> expected) {
  if (absl::Status status = CheckAll(map, inventories); !status.ok()) return status;
  Resolution resolution;
  resolution.version = map.version();
  resolution.resume_tick = NewestTick(inventories) + 2;
  std::vector<Claim> claims;
  const NewestCopies newest = NewestCopiesOf(inventories, dead);
  for (const Inventory& inventory : inventories) AddClaims(inventory, newest, claims);
  const std::map<BodyId, Epoch> removed = TombstonesOf(inventories, dead);
  std::erase_if(claims, [&](const Claim& claim) {
    const auto tombstone = removed.find(claim.body);
    return claim.kind != ClaimKind::kOwned && tombstone != removed.end() && claim.epoch <= tombstone->second;
  });
  std::sort(claims.begin(), claims.end(), Better);
  for (std::size_t i = 0; i < claims.size();) {
    std::size_t end = i + 1;
    while (end < claims.size() && claims[end].body == claims[i].body) ++end;
    Settle(std::span(claims).subspan(i, end - i), map, resolution);
    i = end;
  }
  std::sort(resolution.pending.begin(), resolution.pending.end());
  resolution.pending.erase(std::unique(resolution.pending.begin(), resolution.pending.end()), resolution.pending.end());
  FindLost(expected, claims, removed, resolution);
  for (const RegionId region : dead) {
    const bool held = std::any_of(inventories.begin(), inventories.end(), [region](const Inventory& inventory) {
      return std::any_of(inventory.primaries.begin(), inventory.primaries.end(),
                         [region](const StandbyCopyInventory& primary) { return primary.region == region; });
    });
    if (!held) resolution.without_copy.push_back(region);
  }
  std::sort(resolution.without_copy.begin(), resolution.without_copy.end());
  return resolution;
}

absl::Status CheckResolution(const Resolution& resolution) {
  if (resolution.resume_tick < Tick(2)) return Bad("resume_tick: before anything can have run");
  for (const Takeover& takeover : resolution.takeovers) {
    if (takeover.body == BodyId() || takeover.epoch == Epoch() || takeover.region == RegionId()) {
      return Bad("takeovers: a body, epoch or region 0");
    }
  }
  for (std::size_t i = 1; i < resolution.takeovers.size(); ++i) {
    if (resolution.takeovers[i - 1].body >= resolution.takeovers[i].body) return Bad("takeovers: bodies do not ascend");
  }
  for (const PendingGrant& grant : resolution.pending) {
    if (grant.body == BodyId() || grant.epoch == Epoch() || grant.granter == grant.to) {
      return Bad("pending: a body or epoch 0, or a grant to oneself");
    }
  }
  if (absl::Status status = CheckAscending(resolution.pending, "pending"); !status.ok()) return status;
  if (absl::Status status = CheckAscending(resolution.lost, "lost"); !status.ok()) return status;
  return CheckAscending(resolution.players, "players");
}

}  // namespace tessera::region
