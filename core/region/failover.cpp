#include "core/region/failover.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"

namespace tessera::region {
namespace {

const StandbyCopy* CopyOf(RegionId region, std::span<const StandbyCopy* const> primaries) {
  for (const StandbyCopy* primary : primaries) {
    if (primary->whole() && primary->region() == region) return primary;
  }
  return nullptr;
}

// The newest grant of a body; null if there is none.
const KeptGrant* NewestGrant(const KeptGrants& grants, BodyId id) {
  auto after = grants.upper_bound({id, Epoch(0xffffffff)});
  if (after == grants.begin()) return nullptr;
  --after;
  return after->first.first == id ? &after->second : nullptr;
}

// A body of a dead region's state, in the form of a grant.
KeptGrant CopyFrom(const RegionState& state, const StateBody& body, const PairReports& reports) {
  KeptGrant copy;
  copy.tick = state.tick;
  copy.state = body.state;
  copy.record = state.RecordOf(body.id);
  MarkSettled(state.blasts, copy.record.game);
  if (IsPlayerBody(body.id)) copy.control = state.controls.at(PlayerOf(body.id));
  const auto reported_by = [&](const TouchingPair& pair) { return reports.ReporterOf(pair) == body.id; };
  std::ranges::copy_if(state.touching, std::back_inserter(copy.touching), reported_by);
  return copy;
}

}  // namespace

absl::Status Failover::Begin(const PartitionMap& map, MapVersion in_force, bool* begun) {
  *begun = false;
  if (under_way() && map.version() == map_->version()) return absl::OkStatus();
  const MapVersion known = under_way() ? map_->version() : in_force;
  if (map.version() <= known) {
    return absl::FailedPreconditionError(
        absl::StrCat("map version ", map.version().value(), " is not above ", known.value()));
  }
  map_ = map;
  *begun = true;
  return absl::OkStatus();
}

absl::Status Failover::Check(const Resolution& resolution, Tick now) const {
  if (!under_way()) return absl::FailedPreconditionError("no failover is under way");
  if (resolution.version != map_->version()) {
    return absl::FailedPreconditionError(absl::StrCat("a resolution of version ", resolution.version.value(),
                                                      ", the failover is ", map_->version().value()));
  }
  if (resolution.resume_tick <= now + 1) return absl::FailedPreconditionError("resume_tick: it has passed here");
  return CheckResolution(resolution);
}

PartitionMap Failover::End() { return *std::exchange(map_, std::nullopt); }

void Failover::Validate([[maybe_unused]] MapVersion in_force) const {
  assert(!under_way() || map_->version() > in_force);
}

Inventory TakeInventory(const RegionState& own, MapVersion version, std::span<const StandbyCopy* const> primaries) {
  Inventory inventory;
  inventory.version = version;
  inventory.region = own.region;
  inventory.tick = own.tick;
  StandbyCopyInventory held = InventoryOf(own);
  inventory.owned = std::move(held.bodies);
  inventory.grants = std::move(held.grants);
  inventory.tombstones = std::move(held.tombstones);
  for (const StandbyCopy* primary : primaries) {
    if (primary->whole()) inventory.primaries.push_back(InventoryOf(primary->state()));
  }
  std::ranges::sort(inventory.primaries, {}, &StandbyCopyInventory::region);
  return inventory;
}

absl::StatusOr<std::map<BodyId, KeptGrant>> FindPromoted(const Resolution& resolution, RegionId self,
                                                         const KeptGrants& kept,
                                                         std::span<const StandbyCopy* const> primaries,
                                                         const Catalog& catalog, const PairReports& reports) {
  std::map<BodyId, KeptGrant> copies;
  for (const Takeover& takeover : resolution.takeovers) {
    if (takeover.region != self) continue;
    const StandbyCopy* primary = CopyOf(takeover.from, primaries);
    const RegionState* state = primary == nullptr ? nullptr : &primary->state();
    const bool known = catalog.Known(takeover.body) && (takeover.from == RegionId() || primary != nullptr);
    const KeptGrant* grant = nullptr;
    const StateBody* body = nullptr;
    if (known && takeover.from_grant) grant = NewestGrant(state == nullptr ? kept : state->grants, takeover.body);
    if (known && !takeover.from_grant && state != nullptr) body = state->Find(takeover.body);
    if (grant == nullptr && body == nullptr) {
      return absl::FailedPreconditionError(
          absl::StrCat("body ", takeover.body.value(), " is to be promoted and is not here"));
    }
    copies[takeover.body] = grant != nullptr ? *grant : CopyFrom(*state, *body, reports);
  }
  return copies;
}

KeptGrants FindStillNeeded(const Resolution& resolution, RegionId self, const KeptGrants& kept,
                           std::span<const StandbyCopy* const> primaries) {
  KeptGrants needed;
  for (const PendingGrant& grant : resolution.pending) {
    if (grant.granter != self) continue;
    const KeptGrant* copy = NewestGrant(kept, grant.body);
    for (const StandbyCopy* primary : primaries) {
      const KeptGrant* theirs = NewestGrant(primary->state().grants, grant.body);
      if (theirs != nullptr && (copy == nullptr || theirs->tick > copy->tick)) copy = theirs;
    }
    if (copy == nullptr) continue;
    KeptGrant& again = needed[{grant.body, grant.epoch}] = *copy;
    again.to = grant.to;
  }
  return needed;
}

}  // namespace tessera::region
