#include "control_plane/heirs.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <vector>

namespace tessera::control {
namespace {

struct Candidate {
  std::tuple<bool, bool> needed;  // cut off, on the same host: less is better
  bool stranger;                  // no neighbour
  RegionId region;
};

// Of `self`, in the order of the ids that follow its own.
std::vector<Candidate> Candidates(const PartitionMap& map, std::size_t self, const HostOfRegion& host_of,
                                  const CutBetween& cut) {
  const auto regions = map.regions();
  const RegionId id = regions[self].id;
  const std::vector<RegionId> neighbors = map.Neighbors(id);
  std::vector<Candidate> candidates;
  candidates.reserve(regions.size());
  for (std::size_t step = 1; step < regions.size(); ++step) {
    const RegionId other = regions[(self + step) % regions.size()].id;
    const bool borders = std::binary_search(neighbors.begin(), neighbors.end(), other);
    candidates.push_back({{cut(id, other), host_of(other) == host_of(id)}, !borders, other});
  }
  return candidates;
}

const v1::MapRegion* Find(const v1::PartitionMap& map, std::uint32_t region) {
  const auto found = std::find_if(map.regions().begin(), map.regions().end(),
                                  [region](const v1::MapRegion& r) { return r.id() == region; });
  return found == map.regions().end() ? nullptr : &*found;
}

}  // namespace

std::uint32_t HeirOf(const records::Instance& record, std::uint32_t region) {
  const v1::MapRegion* found = Find(record.map(), region);
  if (found == nullptr) found = Find(record.planned().map(), region);
  return found == nullptr ? 0 : found->heir();
}

absl::StatusOr<PartitionMap> WithHeirs(const PartitionMap& map, const HostOfRegion& host_of, const CutBetween& cut) {
  std::vector<MapRegion> regions(map.regions().begin(), map.regions().end());
  std::map<RegionId, int> inherits;
  // First those that stay, so that the others are spread around them.
  std::vector<std::vector<Candidate>> candidates;
  candidates.reserve(regions.size());
  for (std::size_t i = 0; i < regions.size(); ++i) {
    candidates.push_back(Candidates(map, i, host_of, cut));
    const auto kept = std::find_if(candidates[i].begin(), candidates[i].end(),
                                   [&](const Candidate& c) { return c.region == regions[i].heir; });
    const bool good =
        kept != candidates[i].end() && std::all_of(candidates[i].begin(), candidates[i].end(), [&](const Candidate& c) {
          return kept->needed <= c.needed;  // a warm copy is worth more than a border
        });
    if (good) {
      ++inherits[regions[i].heir];
    } else {
      regions[i].heir = RegionId();
    }
  }
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (regions[i].heir != RegionId()) continue;
    const auto best =
        std::min_element(candidates[i].begin(), candidates[i].end(), [&](const Candidate& a, const Candidate& b) {
          const auto rank = [&](const Candidate& c) { return std::tuple(c.needed, c.stranger, inherits[c.region]); };
          return rank(a) < rank(b);
        });
    if (best == candidates[i].end()) continue;
    regions[i].heir = best->region;
    ++inherits[best->region];
  }
  return PartitionMap::Create(map.version(), map.bounds(), {map.cells().begin(), map.cells().end()},
                              std::move(regions));
}

}  // namespace tessera::control
