#include "control_plane/placement.h"

#include <algorithm>
#include <numeric>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"

namespace tessera::control {
namespace {

constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

// Regions by their place in the map's list, and who borders whom.
using Graph = std::vector<std::vector<std::size_t>>;

Graph Borders(const PartitionMap& map) {
  absl::flat_hash_map<RegionId, std::size_t> index;
  for (const MapRegion& region : map.regions()) index.emplace(region.id, index.size());
  Graph graph(index.size());
  for (const MapRegion& region : map.regions()) {
    for (const RegionId neighbor : map.Neighbors(region.id)) graph[index.at(region.id)].push_back(index.at(neighbor));
  }
  return graph;
}

std::string Plural(std::size_t n, const char* one, const char* many) {
  return absl::StrCat(n, " ", n == 1 ? one : many);
}

absl::Status NoRoom(std::size_t regions, std::size_t hosts, std::size_t free) {
  const std::string need =
      absl::StrCat(Plural(regions, "region needs ", "regions need "), Plural(regions, "place", "places"));
  if (hosts == 0) return absl::ResourceExhaustedError(absl::StrCat(need, "; no host is ready"));
  return absl::ResourceExhaustedError(
      absl::StrCat(need, "; the ", Plural(hosts, "ready host has ", "ready hosts have "), free, " free"));
}

// How many regions each host takes: the fewest hosts that have room, two at least where there are two; as even as their
// room allows.
std::vector<std::size_t> Shares(std::size_t regions, std::span<const FreeHost> hosts) {
  std::size_t used = 0, room = 0;
  while (used < hosts.size() && hosts[used].free > 0 && (room < regions || (used < 2 && regions > 1))) {
    room += hosts[used++].free;
  }
  std::vector<std::size_t> shares(used, 0);
  std::size_t left = regions;
  // From the smallest up, each takes its even part of what is left, or all it has.
  for (std::size_t i = used; i-- > 0;) {
    shares[i] = std::min<std::size_t>(hosts[i].free, left / (i + 1));
    left -= shares[i];
  }
  for (std::size_t i = 0; left > 0; ++i) {
    const std::size_t more = std::min<std::size_t>(hosts[i].free - shares[i], left);
    shares[i] += more;
    left -= more;
  }
  return shares;
}

// Grows one patch of `size` bordering regions: from the free region with the fewest free neighbours (a corner), always
// on to the one with most neighbours inside, then fewest outside, so that no free region is cut off.
void Grow(const Graph& graph, std::size_t host, std::size_t size, std::vector<std::size_t>& host_of) {
  std::vector<int> inside(graph.size(), 0);
  for (std::size_t placed = 0; placed < size; ++placed) {
    std::size_t best = kNowhere;
    std::pair<int, int> best_rank;
    for (std::size_t region = 0; region < graph.size(); ++region) {
      if (host_of[region] != kNowhere) continue;
      const auto free = std::count_if(graph[region].begin(), graph[region].end(),
                                      [&](std::size_t neighbor) { return host_of[neighbor] == kNowhere; });
      const std::pair<int, int> rank(-inside[region], static_cast<int>(free));
      if (best == kNowhere || rank < best_rank) best = region, best_rank = rank;
    }
    host_of[best] = host;
    for (const std::size_t neighbor : graph[best]) ++inside[neighbor];
  }
}

// Each region's heir: on another host if there is one, then a neighbour, then the one that is heir to the fewest, then
// the next one.
std::vector<MapRegion> Heirs(const PartitionMap& map, const Graph& graph, const std::vector<std::size_t>& host_of) {
  std::vector<MapRegion> regions(map.regions().begin(), map.regions().end());
  std::vector<int> inherits(regions.size(), 0);
  for (std::size_t region = 0; region < regions.size() && regions.size() > 1; ++region) {
    std::size_t best = kNowhere;
    std::tuple<bool, bool, int> best_rank;
    for (std::size_t step = 1; step < regions.size(); ++step) {
      const std::size_t heir = (region + step) % regions.size();
      const bool borders = std::find(graph[region].begin(), graph[region].end(), heir) != graph[region].end();
      const std::tuple<bool, bool, int> rank(host_of[heir] == host_of[region], !borders, inherits[heir]);
      if (best == kNowhere || rank < best_rank) best = heir, best_rank = rank;
    }
    regions[region].heir = regions[best].id;
    ++inherits[best];
  }
  return regions;
}

}  // namespace

absl::StatusOr<PlacementPlan> Place(const PartitionMap& map, std::span<const FreeHost> hosts) {
  const std::size_t regions = map.regions().size();
  std::vector<FreeHost> roomy(hosts.begin(), hosts.end());
  // Stable, so that among equals the order given decides.
  std::stable_sort(roomy.begin(), roomy.end(), [](const FreeHost& a, const FreeHost& b) { return a.free > b.free; });
  const std::size_t room = std::accumulate(roomy.begin(), roomy.end(), std::size_t{0},
                                           [](std::size_t sum, const FreeHost& host) { return sum + host.free; });
  if (room < regions) return NoRoom(regions, hosts.size(), room);

  const Graph graph = Borders(map);
  std::vector<std::size_t> host_of(regions, kNowhere);
  const std::vector<std::size_t> shares = Shares(regions, roomy);
  for (std::size_t host = 0; host < shares.size(); ++host) Grow(graph, host, shares[host], host_of);

  PlacementPlan plan;
  for (std::size_t i = 0; i < regions; ++i) plan.regions.push_back({map.regions()[i].id, roomy[host_of[i]].id});
  auto with_heirs = PartitionMap::Create(map.version(), map.bounds(), {map.cells().begin(), map.cells().end()},
                                         Heirs(map, graph, host_of));
  if (!with_heirs.ok()) return with_heirs.status();
  plan.map = *std::move(with_heirs);
  return plan;
}

}  // namespace tessera::control
