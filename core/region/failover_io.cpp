#include "core/region/failover_io.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"

namespace tessera::region {
namespace {

void Put(const std::vector<BodyClaim>& claims, v1::BodyEpochs& out) {
  for (const BodyClaim& claim : claims) {
    out.add_bodies(claim.body.value());
    out.add_epochs(claim.epoch.value());
  }
}

void Put(const std::vector<GrantClaim>& claims, v1::UnacknowledgedGrants& out) {
  for (const GrantClaim& claim : claims) {
    out.add_bodies(claim.body.value());
    out.add_epochs(claim.epoch.value());
    out.add_to(claim.to.value());
  }
}

absl::Status Uneven(const char* list) {
  return absl::InvalidArgumentError(absl::StrCat("inventory.", list, ": lists of different lengths"));
}

absl::Status Take(const v1::BodyEpochs& claims, const char* list, std::vector<BodyClaim>& out) {
  if (claims.bodies_size() != claims.epochs_size()) return Uneven(list);
  out.reserve(static_cast<std::size_t>(claims.bodies_size()));
  for (int i = 0; i < claims.bodies_size(); ++i) out.push_back({BodyId(claims.bodies(i)), Epoch(claims.epochs(i))});
  return absl::OkStatus();
}

absl::Status Take(const v1::UnacknowledgedGrants& claims, const char* list, std::vector<GrantClaim>& out) {
  if (claims.bodies_size() != claims.epochs_size() || claims.bodies_size() != claims.to_size()) return Uneven(list);
  out.reserve(static_cast<std::size_t>(claims.bodies_size()));
  for (int i = 0; i < claims.bodies_size(); ++i) {
    out.push_back({BodyId(claims.bodies(i)), Epoch(claims.epochs(i)), RegionId(claims.to(i))});
  }
  return absl::OkStatus();
}

}  // namespace

v1::Inventory ToProto(const Inventory& inventory,
                      const std::function<std::chrono::milliseconds(const StandbyCopyInventory&)>& last_acknowledged) {
  v1::Inventory out;
  out.set_version(inventory.version.value());
  out.set_region(inventory.region.value());
  out.set_tick(inventory.tick.value());
  Put(inventory.owned, *out.mutable_owned());
  Put(inventory.grants, *out.mutable_unacknowledged());
  Put(inventory.tombstones, *out.mutable_tombstones());
  for (const StandbyCopyInventory& primary : inventory.primaries) {
    v1::StandbyCopyInventory& standby_copy = *out.add_standby_copies();
    standby_copy.set_region(primary.region.value());
    standby_copy.set_incarnation(primary.incarnation.value());
    standby_copy.set_tick(primary.tick.value());
    Put(primary.bodies, *standby_copy.mutable_bodies());
    Put(primary.grants, *standby_copy.mutable_unacknowledged());
    Put(primary.tombstones, *standby_copy.mutable_tombstones());
    standby_copy.set_last_acknowledged_ms(static_cast<std::uint32_t>(
        std::clamp<std::int64_t>(last_acknowledged(primary).count(), 0, std::numeric_limits<std::uint32_t>::max())));
  }
  return out;
}

absl::StatusOr<Inventory> FromProto(const v1::Inventory& inventory) {
  Inventory out{MapVersion(inventory.version()), RegionId(inventory.region()), Tick(inventory.tick()), {}, {}, {}, {}};
  if (absl::Status status = Take(inventory.owned(), "owned", out.owned); !status.ok()) return status;
  if (absl::Status status = Take(inventory.unacknowledged(), "unacknowledged", out.grants); !status.ok()) return status;
  if (absl::Status status = Take(inventory.tombstones(), "tombstones", out.tombstones); !status.ok()) return status;
  out.primaries.reserve(static_cast<std::size_t>(inventory.standby_copies_size()));
  for (const v1::StandbyCopyInventory& standby_copy : inventory.standby_copies()) {
    StandbyCopyInventory& primary = out.primaries.emplace_back();
    primary.region = RegionId(standby_copy.region());
    primary.incarnation = Incarnation(standby_copy.incarnation());
    primary.tick = Tick(standby_copy.tick());
    if (absl::Status status = Take(standby_copy.bodies(), "standbys.bodies", primary.bodies); !status.ok())
      return status;
    if (absl::Status status = Take(standby_copy.unacknowledged(), "standbys.unacknowledged", primary.grants);
        !status.ok()) {
      return status;
    }
    if (absl::Status status = Take(standby_copy.tombstones(), "standbys.tombstones", primary.tombstones);
        !status.ok()) {
      return status;
    }
  }
  if (absl::Status status = CheckInventory(out); !status.ok()) return status;
  return out;
}

v1::Resolution ToProto(const Resolution& resolution) {
  v1::Resolution out;
  out.set_version(resolution.version.value());
  out.set_resume_tick(resolution.resume_tick.value());
  for (const Takeover& takeover : resolution.takeovers) {
    v1::Takeover& added = *out.add_takeovers();
    added.set_body(takeover.body.value());
    added.set_epoch(takeover.epoch.value());
    added.set_region(takeover.region.value());
    added.set_from(takeover.from.value());
    added.set_from_grant(takeover.from_grant);
  }
  for (const PendingGrant& grant : resolution.pending) {
    v1::PendingGrant& added = *out.add_pending();
    added.set_body(grant.body.value());
    added.set_epoch(grant.epoch.value());
    added.set_granter(grant.granter.value());
    added.set_to(grant.to.value());
  }
  for (const BodyId body : resolution.lost) out.add_lost(body.value());
  for (const RegionId region : resolution.without_copy) out.add_without_copy(region.value());
  for (const PlayerNumber player : resolution.players) out.add_players(player.value());
  return out;
}

absl::StatusOr<Resolution> FromProto(const v1::Resolution& resolution) {
  Resolution out;
  out.version = MapVersion(resolution.version());
  out.resume_tick = Tick(resolution.resume_tick());
  out.takeovers.reserve(static_cast<std::size_t>(resolution.takeovers_size()));
  for (const v1::Takeover& takeover : resolution.takeovers()) {
    out.takeovers.push_back({BodyId(takeover.body()), Epoch(takeover.epoch()), RegionId(takeover.region()),
                             RegionId(takeover.from()), takeover.from_grant()});
  }
  out.pending.reserve(static_cast<std::size_t>(resolution.pending_size()));
  for (const v1::PendingGrant& grant : resolution.pending()) {
    out.pending.push_back(
        {BodyId(grant.body()), Epoch(grant.epoch()), RegionId(grant.granter()), RegionId(grant.to())});
  }
  for (const std::uint64_t body : resolution.lost()) out.lost.emplace_back(body);
  for (const std::uint32_t region : resolution.without_copy()) out.without_copy.emplace_back(region);
  for (const std::uint32_t player : resolution.players()) out.players.emplace_back(player);
  if (absl::Status status = CheckResolution(out); !status.ok()) return status;
  return out;
}

}  // namespace tessera::region
