#include "core/region/map_change.h"

#include <algorithm>
#include <cassert>
#include <map>

#include "absl/strings/str_cat.h"

namespace tessera::region {

absl::Status MapChange::Announce(const PartitionMap& map, Tick effective, MapVersion in_force, Tick now) {
  const std::uint64_t version = map.version().value();
  if (map.version() == announced() && effective == effective_) return absl::OkStatus();
  if (map.version() <= in_force) {
    return absl::FailedPreconditionError(
        absl::StrCat("map version ", version, " is not above ", in_force.value(), ", which is in force"));
  }
  if (committed()) {
    return absl::FailedPreconditionError(absl::StrCat("map version ", announced().value(), " is committed"));
  }
  if (map.version() < announced()) {
    return absl::FailedPreconditionError(absl::StrCat("map version ", announced().value(), " is announced"));
  }
  if (effective <= now + 1) {
    return absl::FailedPreconditionError(
        absl::StrCat("tick ", effective.value(), " is too near, here it is ", now.value()));
  }
  map_ = map;
  effective_ = effective;
  return absl::OkStatus();
}

absl::Status MapChange::Commit(MapVersion version, Tick now, std::uint64_t hops) {
  if (!map_.has_value() || version != map_->version()) {
    return absl::NotFoundError(absl::StrCat("map version ", version.value(), " is not announced"));
  }
  if (committed()) return absl::OkStatus();
  // It is in the frames of the next tick, with the neighbours a tick later, and must be everywhere before the frames of
  // effective - 1 are made.
  if (now + 2 + hops > effective_) {
    return absl::FailedPreconditionError(absl::StrCat("tick ", effective_.value(), " is too near, here it is ",
                                                      now.value(), " and everyone needs ", hops, " to hear"));
  }
  committed_ = version;
  return absl::OkStatus();
}

void MapChange::Validate([[maybe_unused]] MapVersion in_force, [[maybe_unused]] Tick now) const {
  assert(map_ == std::nullopt || map_->version() > in_force);
  assert(!DueAt(now));
}

void MapChange::Heard(MapVersion version) { committed_ = std::max(committed_, version); }

std::uint64_t FurthestRegion(const PartitionMap& map, RegionId region) {
  std::map<RegionId, std::uint64_t> distance{{region, 0}};
  std::uint64_t furthest = 0;
  for (std::vector<RegionId> ring{region}; !ring.empty();) {
    std::vector<RegionId> next;
    for (const RegionId id : ring) {
      for (const RegionId neighbor : map.Neighbors(id)) {
        if (distance.emplace(neighbor, distance.at(id) + 1).second) next.push_back(neighbor);
      }
    }
    if (!next.empty()) ++furthest;
    ring = std::move(next);
  }
  return furthest;
}

}  // namespace tessera::region
