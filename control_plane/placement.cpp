#include "control_plane/placement.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "control_plane/standbys.h"

namespace tessera::control {
namespace {

constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

// For each region, by its place in the map's list: the regions that it borders.
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

// How many regions each host takes. As few hosts are used as have room, at least two where there are two, and as evenly
// as their room allows.
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

// True if the free regions other than `taken` are connected.
bool StaysConnected(const Graph& graph, const std::vector<std::size_t>& host_of, std::size_t taken) {
  std::vector<bool> open(graph.size());
  for (std::size_t region = 0; region < graph.size(); ++region)
    open[region] = host_of[region] == kNowhere && region != taken;
  const auto first = std::find(open.begin(), open.end(), true);
  if (first == open.end()) return true;
  std::vector<std::size_t> front{static_cast<std::size_t>(first - open.begin())};
  *first = false;
  while (!front.empty()) {
    const std::size_t region = front.back();
    front.pop_back();
    for (const std::size_t neighbor : graph[region]) {
      if (!open[neighbor]) continue;
      open[neighbor] = false;
      front.push_back(neighbor);
    }
  }
  return std::find(open.begin(), open.end(), true) == open.end();
}

// The next region of a patch: the free one with most neighbours inside, then fewest free ones outside (at first: a
// corner), if that leaves the free regions in one piece. `inside`: each region's neighbours in the patch.
std::size_t NextOfPatch(const Graph& graph, const std::vector<std::size_t>& host_of, const std::vector<int>& inside) {
  std::vector<std::tuple<int, std::ptrdiff_t, std::size_t>> candidates;
  for (std::size_t region = 0; region < graph.size(); ++region) {
    if (host_of[region] != kNowhere) continue;
    const auto free = std::count_if(graph[region].begin(), graph[region].end(),
                                    [&](std::size_t neighbor) { return host_of[neighbor] == kNowhere; });
    candidates.emplace_back(-inside[region], free, region);
  }
  std::sort(candidates.begin(), candidates.end());
  for (const auto& [rank, free, region] : candidates) {
    const bool grows = rank < 0 || std::get<0>(candidates.front()) == 0;
    if (grows && StaysConnected(graph, host_of, region)) return region;
  }
  return std::get<2>(candidates.front());
}

// Places one patch of `size` bordering regions on the host.
void Grow(const Graph& graph, std::size_t host, std::size_t size, std::vector<std::size_t>& host_of) {
  std::vector<int> inside(graph.size(), 0);
  for (std::size_t placed = 0; placed < size; ++placed) {
    const std::size_t region = NextOfPatch(graph, host_of, inside);
    host_of[region] = host;
    for (const std::size_t neighbor : graph[region]) ++inside[neighbor];
  }
}

// Standbys are chosen afresh: no copy is warm yet.
absl::StatusOr<PartitionMap> WithNewStandbys(const PartitionMap& map, const std::vector<PlacedRegion>& placed) {
  std::vector<MapRegion> regions(map.regions().begin(), map.regions().end());
  for (MapRegion& region : regions) region.standby = RegionId();
  const auto bare =
      PartitionMap::Create(map.version(), map.bounds(), {map.cells().begin(), map.cells().end()}, std::move(regions));
  if (!bare.ok()) return bare.status();
  std::map<RegionId, std::string> hosts;
  for (const PlacedRegion& region : placed) hosts[region.region] = region.host_id;
  return WithStandbys(
      *bare, [&hosts](RegionId id) { return hosts.at(id); }, [](RegionId, RegionId) { return false; });
}

}  // namespace

absl::StatusOr<PlacementPlan> Place(const PartitionMap& map, std::span<const FreeHost> hosts) {
  const std::size_t regions = map.regions().size();
  std::vector<FreeHost> roomy(hosts.begin(), hosts.end());
  // The sort is stable, so that among equals the order given decides.
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
  auto with_standbys = WithNewStandbys(map, plan.regions);
  if (!with_standbys.ok()) return with_standbys.status();
  plan.map = *std::move(with_standbys);
  return plan;
}

}  // namespace tessera::control
