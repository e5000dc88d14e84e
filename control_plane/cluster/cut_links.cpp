#include "control_plane/cluster/cut_links.h"

#include <algorithm>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "control_plane/change.h"
#include "control_plane/cluster/liveness.h"
#include "control_plane/cluster/loaded_bodies.h"
#include "control_plane/standbys.h"
#include "control_plane/world_terms.h"

namespace tessera::control {
namespace {

// The index of the region's worker, unless it has ended; `workers.size()` if there is none.
std::size_t LivingIndexOf(const InstanceEntry& instance, std::uint32_t region) {
  const auto at = std::find_if(instance.workers.begin(), instance.workers.end(),
                               [region](const WorkerEntry& worker) { return worker.region == region && !worker.gone; });
  return static_cast<std::size_t>(at - instance.workers.begin());
}

// Empty if the region has no worker.
std::string HostIdOf(const InstanceEntry& instance, std::uint32_t region) {
  const std::size_t index = LivingIndexOf(instance, region);
  if (index == instance.workers.size()) return "";
  return instance.record.placements(static_cast<int>(index)).host_id();
}

bool Touches(const CutLink& cut, std::uint32_t region) { return cut.one == region || cut.other == region; }

bool HasCells(const InstanceEntry& instance, std::uint32_t region) {
  const auto cells = instance.map.cells();
  return std::any_of(cells.begin(), cells.end(), [region](const Cell& cell) { return cell.owner.value() == region; });
}

// The ends of these links, the one that is to go in front: one that leaves anyway, else as cut_links.h says.
std::vector<std::uint32_t> EndsByRank(const InstanceEntry& instance, std::span<const CutLink> cuts) {
  std::set<std::uint32_t> ends;
  std::map<std::string, int> of_host;  // links that end there
  for (const CutLink& cut : cuts) {
    ends.insert({cut.one, cut.other});
    for (const std::string& host : std::set{HostIdOf(instance, cut.one), HostIdOf(instance, cut.other)}) {
      ++of_host[host];
    }
  }
  const auto rank = [&](std::uint32_t region) {
    const auto own = std::count_if(cuts.begin(), cuts.end(), [region](const CutLink& c) { return Touches(c, region); });
    const WorkerEntry& worker = instance.workers[LivingIndexOf(instance, region)];
    return std::tuple(HasCells(instance, region), -of_host[HostIdOf(instance, region)], -own,
                      LoadedBodies(worker.report));
  };
  std::vector<std::uint32_t> ranked(ends.begin(), ends.end());
  std::stable_sort(ranked.begin(), ranked.end(), [&](std::uint32_t a, std::uint32_t b) { return rank(a) < rank(b); });
  return ranked;
}

// Hosts from which a link to one of the region's neighbours is known to be cut, and its own.
std::set<std::string> ShunnedBy(const InstanceEntry& instance, std::uint32_t region, std::span<const FreeHost> hosts) {
  std::set<std::pair<std::string, std::string>> known;
  for (const CutLink& cut : instance.cut_links) {
    known.insert(std::minmax(HostIdOf(instance, cut.one), HostIdOf(instance, cut.other)));
  }
  std::set<std::string> shunned{HostIdOf(instance, region)};
  for (const FreeHost& host : hosts) {
    for (const RegionId neighbor : instance.map.Neighbors(RegionId(region))) {
      const std::string there = HostIdOf(instance, neighbor.value());
      if (known.contains(std::minmax(host.id, there))) shunned.insert(host.id);
    }
  }
  return shunned;
}

}  // namespace

// Those that are cut for long enough and whose ends both report.
std::vector<CutLink> CutLinks::Lasting(const InstanceEntry& instance, Now now) const {
  const auto reports = [&](std::uint32_t region) {
    const std::size_t index = LivingIndexOf(instance, region);
    if (index == instance.workers.size()) return false;
    const WorkerEntry& worker = instance.workers[index];
    return worker.report.phase() == v1::WORKER_PHASE_RUNNING && now.steady - worker.reported_at < kStillAfter;
  };
  std::vector<CutLink> lasting;
  std::copy_if(
      instance.cut_links.begin(), instance.cut_links.end(), std::back_inserter(lasting), [&](const CutLink& cut) {
        return now.steady - cut.since >= kCutAfter + settings_.move_cut_after && reports(cut.one) && reports(cut.other);
      });
  return lasting;
}

CutDecision CutLinks::Look(const InstanceEntry& instance, std::span<const FreeHost> hosts, Now now) const {
  const std::vector<CutLink> lasting = Lasting(instance, now);
  if (lasting.empty()) return {};
  if (MovedLately(instance, now)) {
    return {.move = {},
            .stuck = absl::StrCat(Describe(instance, lasting.front()),
                                  ", and a region was moved for a cut link less than ten minutes ago: ",
                                  Mend(instance, lasting.front()))};
  }
  for (const std::uint32_t region : EndsByRank(instance, lasting)) {
    std::set<std::string> shunned = ShunnedBy(instance, region, hosts);
    const bool room = std::any_of(hosts.begin(), hosts.end(), [&](const FreeHost& host) {
      return host.free > 0 && !host.avoided && !shunned.contains(host.id);
    });
    if (!room) continue;
    const auto cut =
        std::find_if(lasting.begin(), lasting.end(), [region](const CutLink& c) { return Touches(c, region); });
    return {.move = CutMove{region, std::move(shunned), Describe(instance, *cut)}, .stuck = {}};
  }
  return {.move = {},
          .stuck = absl::StrCat(Describe(instance, lasting.front()),
                                ", and no other host has room for either: add a host, or ",
                                Mend(instance, lasting.front()))};
}

bool CutLinks::IsNews(std::uint64_t number, const std::string& stuck) {
  return std::exchange(watched_[number].told, stuck) != stuck && !stuck.empty();
}

void CutLinks::NoteMoved(const InstanceEntry& instance, std::uint32_t region, Now now) {
  Watched& watched = watched_[instance.number];
  watched.moved_until = now.steady + kMovedRegionInterval;
  watched.left_host = HostIdOf(instance, region);
  watched.moved_incarnation = instance.workers[LivingIndexOf(instance, region)].incarnation;
}

bool CutLinks::MovedLately(const InstanceEntry& instance, Now now) const {
  const auto watched = watched_.find(instance.number);
  if (watched == watched_.end() || now.steady >= watched->second.moved_until) return false;
  return std::none_of(instance.workers.begin(), instance.workers.end(), [&](const WorkerEntry& worker) {
    return worker.incarnation == watched->second.moved_incarnation;
  });
}

bool CutLinks::Avoids(std::uint64_t number, const std::string& host_id, Now now) const {
  const auto watched = watched_.find(number);
  return watched != watched_.end() && now.steady < watched->second.moved_until && host_id == watched->second.left_host;
}

std::optional<std::uint32_t> CutLinks::HoldingUp(const InstanceEntry& instance, Now now) {
  Watched& watched = watched_[instance.number];
  const records::Instance& record = instance.record;
  const std::vector<CutLink> lasting = Lasting(instance, now);
  const bool outside = std::any_of(instance.workers.begin(), instance.workers.end(),
                                   [](const WorkerEntry& worker) { return worker.report.bodies_outside() > 0; });
  if (lasting.empty() || !outside || record.has_planned() || AtRest(record) || IsPaused(record) ||
      !AllRunByMap(instance)) {
    watched.held_up_since = Steady(0);
    return std::nullopt;
  }
  if (watched.held_up_since.count() == 0) watched.held_up_since = now.steady;
  if (now.steady - watched.held_up_since < kCutChangePatience) return std::nullopt;
  const std::vector<std::uint32_t> ends = EndsByRank(instance, lasting);
  const bool one_leaves = !HasCells(instance, ends.front());
  if (!one_leaves && MovedLately(instance, now)) return std::nullopt;
  for (const std::uint32_t region : ends) {
    if (one_leaves && HasCells(instance, region)) break;
    if (Covered(instance, region, now)) return region;
  }
  return std::nullopt;
}

// True if the region's standby hears it, is heard itself, and has a whole copy of it.
bool CutLinks::Covered(const InstanceEntry& instance, std::uint32_t region, Now now) const {
  const WorkerEntry& worker = instance.workers[LivingIndexOf(instance, region)];
  const std::uint32_t standby = StandbyOf(instance.record, region);
  const std::size_t index = LivingIndexOf(instance, standby);
  const bool cut = std::any_of(instance.cut_links.begin(), instance.cut_links.end(),
                               [&](const CutLink& link) { return Touches(link, region) && Touches(link, standby); });
  return index < instance.workers.size() && !cut && !worker.report.unprotected() &&
         HoldsCopyOf(instance.workers[index], worker.incarnation) &&
         !Silent(state_, instance, index, settings_.failover_after, now);
}

std::string CutLinks::Describe(const InstanceEntry& instance, const CutLink& cut) const {
  const auto name = [&](std::uint32_t region) {
    const HostEntry* host = state_.FindHost(HostIdOf(instance, region));
    return absl::StrCat("region ", region, host == nullptr ? "" : absl::StrCat(" on ", host->record.name()));
  };
  return absl::StrCat(name(cut.one), " and ", name(cut.other), " have no link");
}

// "let UDP through between alpha and beta on the ports of --port-range"
std::string CutLinks::Mend(const InstanceEntry& instance, const CutLink& cut) const {
  const HostEntry *one = state_.FindHost(HostIdOf(instance, cut.one)),
                  *other = state_.FindHost(HostIdOf(instance, cut.other));
  if (one == nullptr || other == nullptr) return "let their hosts' UDP through";
  return one == other ? absl::StrCat("let UDP through within ", one->record.name())
                      : absl::StrCat("let UDP through between ", one->record.name(), " and ", other->record.name());
}

}  // namespace tessera::control
