#include "control_plane/cluster/change_words.h"

#include <algorithm>
#include <set>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"

namespace tessera::control {
namespace {

constexpr std::size_t kMostNamedRegions = 4;  // for each kind, in an event

// "region 5 on beta has begun" of those in `here` and not in `there`; the others beyond a few are counted.
void AddMissing(const Layout& here, const Layout& there, const char* what, std::vector<std::string>& said) {
  std::size_t missing = 0;
  for (const auto& [region, host] : here.hosts) {
    if (there.hosts.contains(region) || ++missing > kMostNamedRegions) continue;
    said.push_back(absl::StrCat("region ", region, " on ", host, " has ", what));
  }
  if (missing > kMostNamedRegions) said.push_back(absl::StrCat(missing - kMostNamedRegions, " more have ", what));
}

bool SameCells(const v1::PartitionMap& a, const v1::PartitionMap& b) {
  return std::equal(
      a.cells().begin(), a.cells().end(), b.cells().begin(), b.cells().end(),
      [](const v1::Cell& x, const v1::Cell& y) { return x.SerializeAsString() == y.SerializeAsString(); });
}

// "host beta is to be emptied": the first of the changes that are wanted, as PlanChange takes them.
std::string WantedChange(const ClusterState& state, const records::Instance& record,
                         std::span<const RegionFacts> facts) {
  std::set<std::string> drained;
  bool replaced = false;
  for (const RegionFacts& region : facts) {
    const HostEntry* host = state.FindHost(region.host_id);
    if (region.host_draining && host != nullptr) drained.insert(host->record.name());
    replaced = replaced || region.incarnation <= record.replace_up_to();
  }
  if (!drained.empty()) {
    return absl::StrCat(drained.size() == 1 ? "host " : "hosts ", absl::StrJoin(drained, ", "),
                        drained.size() == 1 ? " is" : " are", " to be emptied");
  }
  if (replaced) return "workers are to be replaced";
  return absl::StrCat(record.wanted_regions(), " regions are wanted, where ", record.map().regions_size(), " run");
}

}  // namespace

Layout LayoutOf(const ClusterState& state, const records::Instance& record) {
  Layout layout{.hosts = {}, .map = record.map()};
  for (const records::Placement& placement : record.placements()) {
    if (placement.joins()) continue;
    const HostEntry* host = state.FindHost(placement.host_id());
    layout.hosts[placement.region()] = host == nullptr ? "a removed host" : host->record.name();
  }
  return layout;
}

std::string DescribeDone(const std::optional<Layout>& before, const Layout& after) {
  std::vector<std::string> said;
  if (before) {
    AddMissing(after, *before, "begun", said);
    AddMissing(*before, after, "left", said);
    if (said.empty()) {
      said.emplace_back(SameCells(before->map, after.map) ? "standbys have changed" : "borders have moved");
    }
  } else {
    said.emplace_back("a change is done");
  }
  const std::size_t regions = after.hosts.size();
  return absl::StrCat(absl::StrJoin(said, ", "), ": ", regions, regions == 1 ? " region runs" : " regions run");
}

std::string DescribeNoRoom(const ClusterState& state, const records::Instance& record,
                           std::span<const RegionFacts> facts, const std::string& why) {
  return OneLine(absl::StrCat("waits for room: ", WantedChange(state, record, facts), ", and ", why,
                              ": add a host, or let one take more regions"),
                 kMaxReasonBytes);
}

}  // namespace tessera::control
