#include "core/region/region_map.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/region/claims.h"

namespace tessera::region {

void AdoptMap(PartitionMap map, bool anew, RegionParts& parts) {
  parts.game.Adopt(map.terms().game);
  parts.neighborhood.Adopt(std::move(map));
  const std::span<const RegionId> neighbors = parts.neighborhood.neighbors();
  parts.outgoing.SetNeighbors(neighbors, anew);
  parts.grants_in.SetNeighbors(neighbors, anew);
  parts.shared.SetNeighbors(neighbors, anew);
  for (const auto& [from, bytes] : parts.borders.ChangeMap(parts.neighborhood.map().version(), neighbors, anew)) {
    const BorderFrame* taken = nullptr;
    if (!parts.borders.Put(from, bytes, parts.tick, &taken).ok() || taken == nullptr) continue;
    if (!CheckClaims(*taken, parts.bodies, parts.grants_out.departing(), parts.grants_in).ok()) {
      parts.borders.Reject(from);
    }
  }
}

void AdoptMapIfDue(RegionParts& parts) {
  if (!parts.map_change.DueAt(parts.tick)) return;
  PartitionMap map = *parts.map_change.map();
  parts.map_change.Clear();
  AdoptMap(std::move(map), false, parts);
}

absl::Status Region::Announce(const PartitionMap& map, Tick effective) {
  RegionParts& parts = *parts_;
  if (halted()) return absl::FailedPreconditionError("a failover is under way");
  if (const std::uint32_t game = map.terms().game; !parts.game.Has(game)) {
    return absl::FailedPreconditionError(absl::StrCat("game ", game, " is not loaded here"));
  }
  const MapVersion in_force = parts.neighborhood.map().version();
  if (absl::Status status = parts.map_change.Announce(map, effective, in_force, parts.tick); !status.ok()) {
    return status;
  }
  parts.borders.Expect(map.version(), map.Neighbors(id()));
  parts.neighborhood.Announce(map);
  return absl::OkStatus();
}

absl::Status Region::Commit(MapVersion version, bool stands) {
  if (halted()) return absl::FailedPreconditionError("a failover is under way");
  const std::uint64_t links = stands ? 0 : FurthestRegion(map(), id());
  return parts_->map_change.Commit(version, tick(), links * (parts_->settings.promise_ticks + 1));
}

std::size_t Region::away_count() const {
  return CountAway(parts_->bodies, parts_->grants_out.kept(), parts_->catalog, parts_->neighborhood, parts_->settings,
                   parts_->tick_s);
}

}  // namespace tessera::region
