#include "control_plane/cluster/world_releases.h"

#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/release.h"

namespace tessera::control {
namespace {

// On how many of the hosts that take regions each release is.
std::map<std::string, int> ReadyReleases(const ClusterState& state) {
  std::map<std::string, int> hosts;
  for (const auto& [number, host] : state.hosts()) {
    if (StateOf(host) != v1::HOST_STATE_READY) continue;
    for (const std::string& release : ReleasesOf(host.record)) ++hosts[release];
  }
  return hosts;
}

// At least one, best first.
std::vector<std::string> Candidates(const ClusterState& state, const std::string& own, ReleaseChoice choice) {
  const std::map<std::string, int> hosts = ReadyReleases(state);
  if (choice == ReleaseChoice::kKept && hosts.contains(own)) return {own};
  std::vector<std::string> releases;
  for (const auto& [release, count] : hosts) {
    if (choice == ReleaseChoice::kNewest && IsOlderRelease(release, own)) continue;
    releases.push_back(release);
  }
  if (releases.empty()) return {own};
  std::ranges::sort(releases, [&](const std::string& a, const std::string& b) {
    if (choice != ReleaseChoice::kNewest && hosts.at(a) != hosts.at(b)) return hosts.at(a) > hosts.at(b);
    return IsOlderRelease(b, a);
  });
  return releases;
}

}  // namespace

std::vector<std::string> ReleasesOf(const records::Host& host) {
  if (!host.releases().empty()) return {host.releases().begin(), host.releases().end()};
  if (host.version().empty()) return {};
  return {host.version()};
}

bool HasRelease(const records::Host& host, const std::string& release) {
  const std::vector<std::string> releases = ReleasesOf(host);
  return release.empty() || releases.empty() || std::ranges::count(releases, release) > 0;
}

absl::StatusOr<BeginningPlan> PlaceBeginning(const ClusterState& state, const PartitionMap& map,
                                             const RegionNeeds& needs, const InstanceEntry* without,
                                             ReleaseChoice choice, Steady silence, Now now) {
  absl::Status first;
  for (const std::string& release : Candidates(state, needs.release, choice)) {
    RegionNeeds with = needs;
    with.release = release;
    auto placed = PlaceAnew(state, map, with, without, silence, now);
    if (placed.ok()) return BeginningPlan{*std::move(placed), release};
    if (first.ok()) first = placed.status();
  }
  return first;
}

void SetRelease(const std::string& release, Now now, records::Instance& record) {
  const std::string before = std::exchange(*record.mutable_release(), release);
  if (before.empty() || before == release) return;
  AddEvent(record, now, absl::StrCat("its workers are of release ", release, " now, and were of ", before));
}

absl::Status GiveReleases(ClusterState& state) {
  for (InstanceEntry& instance : state.EachInstance()) {
    if (!instance.record.release().empty() || IsFinal(instance.record.state())) continue;
    records::Instance next = instance.record;
    next.set_release(kFirstRelease);
    if (absl::Status status = state.StoreInstance(instance, next); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace tessera::control
