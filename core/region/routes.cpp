#include "core/region/routes.h"

#include <utility>

namespace tessera::region {

void Routes::Adopt(const PartitionMap& map) {
  if (version_ == map.version()) return;
  version_ = map.version();
  neighbors_.clear();
  from_.clear();
  for (const MapRegion& region : map.regions()) neighbors_[region.id] = map.Neighbors(region.id);
}

const Routes::Distances& Routes::From(RegionId root) {
  const auto [entry, added] = from_.try_emplace(root);
  Distances& distances = entry->second;
  if (!added || !neighbors_.contains(root)) return distances;
  distances.emplace(root, 0);
  std::vector<RegionId> ring{root};
  for (std::uint32_t distance = 1; !ring.empty(); ++distance) {
    std::vector<RegionId> next;
    for (const RegionId region : ring) {
      for (const RegionId neighbor : neighbors_.at(region)) {
        if (distances.emplace(neighbor, distance).second) next.push_back(neighbor);
      }
    }
    ring = std::move(next);
  }
  return distances;
}

std::optional<std::uint32_t> Routes::Distance(RegionId from, RegionId to) {
  const Distances& distances = From(from);
  const auto found = distances.find(to);
  return found == distances.end() ? std::nullopt : std::optional(found->second);
}

RegionId Routes::NextHop(RegionId self, RegionId to, absl::FunctionRef<bool(RegionId)> up) {
  const auto own = neighbors_.find(self);
  if (own == neighbors_.end()) return {};
  const Distances& distances = From(to);
  std::pair<std::uint32_t, RegionId> best;
  for (const RegionId neighbor : own->second) {
    const auto distance = distances.find(neighbor);
    if (distance == distances.end() || !up(neighbor)) continue;
    const std::pair candidate(distance->second, neighbor);
    if (best.second == RegionId() || candidate < best) best = candidate;
  }
  return best.second;
}

}  // namespace tessera::region
