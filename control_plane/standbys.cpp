#include "control_plane/standbys.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <vector>

#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

struct StandbyCandidate {
  std::tuple<bool, bool> needed;  // cut off, on the same host: less is better
  bool apart;                     // borders nowhere
  RegionId region;
};

// All regions but the one at `self`, in the order of the ids that follow its own. `hosts` are those of the map's
// regions.
std::vector<StandbyCandidate> StandbyCandidates(const PartitionMap& map, std::size_t self,
                                                const std::vector<std::string>& hosts, const CutBetween& cut) {
  const auto regions = map.regions();
  const RegionId id = regions[self].id;
  const std::vector<RegionId> neighbors = map.Neighbors(id);
  std::vector<StandbyCandidate> candidates;
  candidates.reserve(regions.size());
  for (std::size_t step = 1; step < regions.size(); ++step) {
    const std::size_t at = (self + step) % regions.size();
    const RegionId other = regions[at].id;
    const bool borders = std::binary_search(neighbors.begin(), neighbors.end(), other);
    candidates.push_back({{cut(id, other), hosts[at] == hosts[self]}, !borders, other});
  }
  return candidates;
}

// True if no other region is needed more as a standby: a warm copy is worth more than a border.
bool StaysStandby(RegionId standby, const std::vector<StandbyCandidate>& candidates) {
  const auto kept = std::find_if(candidates.begin(), candidates.end(),
                                 [standby](const StandbyCandidate& c) { return c.region == standby; });
  return kept != candidates.end() && std::all_of(candidates.begin(), candidates.end(),
                                                 [&](const StandbyCandidate& c) { return kept->needed <= c.needed; });
}

}  // namespace

HostOfRegion HostsOf(const records::Instance& record) {
  std::map<std::uint32_t, std::string> hosts;
  for (const records::Placement& placement : record.placements()) hosts[placement.region()] = placement.host_id();
  return [hosts = std::move(hosts)](RegionId region) {
    const auto found = hosts.find(region.value());
    return found == hosts.end() ? std::string() : found->second;
  };
}

std::uint32_t StandbyOf(const records::Instance& record, std::uint32_t region) {
  const v1::MapRegion* found = FindRegion(record.map(), RegionId(region));
  if (found == nullptr) found = FindRegion(record.planned().map(), RegionId(region));
  return found == nullptr ? 0 : found->standby();
}

absl::StatusOr<PartitionMap> WithStandbys(const PartitionMap& map, const HostOfRegion& host_of, const CutBetween& cut) {
  std::vector<MapRegion> regions(map.regions().begin(), map.regions().end());
  std::vector<std::string> hosts;
  hosts.reserve(regions.size());
  for (const MapRegion& region : regions) hosts.push_back(host_of(region.id));
  std::map<RegionId, int> primaries;  // how many each is standby to
  std::vector<std::vector<StandbyCandidate>> candidates;
  candidates.reserve(regions.size());
  // Those that stay come first, so that the others are spread around them.
  for (std::size_t i = 0; i < regions.size(); ++i) {
    candidates.push_back(StandbyCandidates(map, i, hosts, cut));
    if (StaysStandby(regions[i].standby, candidates[i])) {
      ++primaries[regions[i].standby];
    } else {
      regions[i].standby = RegionId();
    }
  }
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (regions[i].standby != RegionId() || candidates[i].empty()) continue;
    const auto rank = [&](const StandbyCandidate& c) { return std::tuple(c.needed, c.apart, primaries[c.region]); };
    const auto best =
        std::min_element(candidates[i].begin(), candidates[i].end(),
                         [&](const StandbyCandidate& a, const StandbyCandidate& b) { return rank(a) < rank(b); });
    regions[i].standby = best->region;
    ++primaries[best->region];
  }
  return PartitionMap::Create(map.version(), map.bounds(), {map.cells().begin(), map.cells().end()},
                              std::move(regions));
}

}  // namespace tessera::control
