#include "control_plane/change.h"

#include <algorithm>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/standbys.h"
#include "control_plane/world_terms.h"
#include "core/world/limits.h"
#include "core/world/partition_change.h"
#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

// The newest tick of the regions that step: a newcomer stands at the tick from which it is to join.
std::uint64_t NewestTick(std::span<const RegionFacts> facts) {
  std::uint64_t newest = 0;
  for (const RegionFacts& region : facts) {
    if (!region.newcomer) newest = std::max(newest, region.tick);
  }
  return newest;
}

// Ticks that a commitment may take from region to region in the worst case; the region core has the same bound.
std::uint64_t FloodTicks(std::span<const RegionFacts> facts) { return facts.size() + 1; }

// The lead grows with each time that a plan was put off.
std::uint64_t LeadTicks(const records::Instance& record, std::span<const RegionFacts> facts) {
  const std::uint64_t tries = std::max(record.last_map_version(), record.map().version() + 1) - record.map().version();
  const auto lead = static_cast<std::uint64_t>(kPlanLead.count()) * record.tick_rate_hz() / 1000;
  return lead * std::min<std::uint64_t>(tries, 8) + FloodTicks(facts);
}

// The plan gets a new version, so that nobody can take it for the one that failed. Newcomers have made ready for the
// old tick: others take their places.
records::Instance PutOff(const records::Instance& record) {
  records::Instance next = record;
  next.set_last_map_version(record.last_map_version() + 1);
  v1::PlannedMap& planned = *next.mutable_planned();
  planned.mutable_map()->set_version(next.last_map_version());
  planned.set_effective_tick(0);
  planned.set_committed(false);
  for (records::Placement& placement : *next.mutable_placements()) {
    if (!placement.joins()) continue;
    placement.set_incarnation(next.last_incarnation() + 1);
    next.set_last_incarnation(placement.incarnation());
  }
  return next;
}

records::Instance InForce(const records::Instance& record) {
  records::Instance next = record;
  AdoptTerms(record.planned().map(), record.planned().effective_tick(), next);
  next.mutable_map()->Swap(next.mutable_planned()->mutable_map());
  next.clear_planned();
  auto& placements = *next.mutable_placements();
  const auto unmapped = [&next](const records::Placement& placement) {
    return FindRegion(next.map(), RegionId(placement.region())) == nullptr;
  };
  placements.erase(std::remove_if(placements.begin(), placements.end(), unmapped), placements.end());
  for (records::Placement& placement : placements) placement.set_joins(false);
  return next;
}

CutBetween CutsIn(std::span<const RegionFacts> facts) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> cuts;
  for (const RegionFacts& region : facts) {
    for (const std::uint32_t other : region.cut_from) cuts.emplace(region.region, other);
  }
  return [cuts = std::move(cuts)](RegionId a, RegionId b) {
    return cuts.contains({a.value(), b.value()}) || cuts.contains({b.value(), a.value()});
  };
}

void SetPlanned(const PartitionMap& map, records::Instance& next) {
  next.set_last_map_version(map.version().value());
  *next.mutable_planned()->mutable_map() = ToProto(map);
  SetTerms(TermsOf(next), *next.mutable_planned()->mutable_map());
  next.mutable_planned()->set_effective_tick(0);
  next.mutable_planned()->set_committed(false);
}

MapVersion NextVersion(const records::Instance& record) {
  return MapVersion(std::max(record.last_map_version(), record.map().version()) + 1);
}

std::optional<records::Instance> Settle(const records::Instance& record, std::span<const RegionFacts> facts) {
  const auto map = FromProto(record.map());
  if (!map.ok() || !InTransition(*map)) return std::nullopt;
  for (const RegionFacts& region : facts) {
    if (region.map_version < record.map().version() || region.bodies_outside > 0) return std::nullopt;
  }
  const auto settled = SettledMap(*map, NextVersion(record));
  if (!settled.ok()) return std::nullopt;
  const auto with_standbys = WithStandbys(*settled, HostsOf(record), CutsIn(facts));
  if (!with_standbys.ok()) return std::nullopt;
  records::Instance next = record;
  SetPlanned(*with_standbys, next);
  return next;
}

// A region that its standby does not hear acknowledges nothing, so bodies on their way to it stay on their way, and a
// change that moves them would not end. It gets another standby first.
std::optional<records::Instance> OtherStandbys(const records::Instance& record, std::span<const RegionFacts> facts) {
  const auto settled = [&](const RegionFacts& region) {
    return region.running && region.map_version >= record.map().version();
  };
  const auto cut = [](const RegionFacts& region) { return !region.cut_from.empty(); };
  if (std::none_of(facts.begin(), facts.end(), cut) || !std::all_of(facts.begin(), facts.end(), settled)) {
    return std::nullopt;
  }
  const auto map = FromProto(record.map());
  if (!map.ok()) return std::nullopt;
  const auto next_map =
      PartitionMap::Create(NextVersion(record), map->bounds(), {map->cells().begin(), map->cells().end()},
                           {map->regions().begin(), map->regions().end()});
  if (!next_map.ok()) return std::nullopt;
  const auto with_standbys = WithStandbys(*next_map, HostsOf(record), CutsIn(facts));
  if (!with_standbys.ok() || std::equal(with_standbys->regions().begin(), with_standbys->regions().end(),
                                        map->regions().begin(), map->regions().end())) {
    return std::nullopt;
  }
  records::Instance next = record;
  SetPlanned(*with_standbys, next);
  return next;
}

// --- What to plan ---

class Planner {
 public:
  Planner(const records::Instance& record, std::span<const RegionFacts> facts, std::span<const FreeHost> hosts,
          PartitionMap map, RegionTree tree)
      : record_(record),
        facts_(facts),
        hosts_(hosts.begin(), hosts.end()),
        map_(std::move(map)),
        tree_(std::move(tree)) {
    next_ = record;
    for (const RegionFacts& region : facts) {
      loads_[RegionId(region.region)] = region.step_s;
      if (!region.spread.x.empty()) spreads_[RegionId(region.region)] = region.spread;
    }
    const bool measured = std::all_of(loads_.begin(), loads_.end(), [](const auto& load) { return load.second > 0; });
    if (!measured) loads_ = Areas();
  }

  absl::StatusOr<std::optional<records::Instance>> Plan() {
    const auto changed = ReplaceOne();
    // A world that is to shrink makes the place that a replacement lacks.
    const bool shrinks = record_.wanted_regions() != 0 && tree_.Regions().size() > record_.wanted_regions();
    if (!changed.ok() && !shrinks) return changed.status();
    if (!changed.ok() || !*changed) {
      const auto scaled = Scale();
      if (!scaled.ok()) return scaled.status();
      const auto left = *scaled ? absl::StatusOr<bool>(true) : LeaveHost();
      if (!left.ok()) return left.status();
      // Nothing is begun without need while a link is cut: bodies that wait for the link would hold it up.
      if (*left || HasCut()) return Finish();
      const auto spread = SpreadOne();
      if (!spread.ok()) return spread.status();
      if (!*spread && record_.balance() && Imbalance(loads_) > kBalanceAbove) {
        tree_.Balance(loads_, spreads_, kBalanceStep);
      }
    }
    return Finish();
  }

 private:
  RegionLoads Areas() const {
    RegionLoads areas;
    for (const Cell& cell : map_.cells()) {
      areas[cell.owner] += (cell.area.max_x - cell.area.min_x) * (cell.area.max_z - cell.area.min_z);
    }
    return areas;
  }

  std::uint32_t FreeId() const {
    std::set<std::uint32_t> taken;
    for (const records::Placement& placement : next_.placements()) taken.insert(placement.region());
    std::uint32_t id = 1;
    while (taken.contains(id)) ++id;
    return id;
  }

  // Adds a region on the host `wished` if it has room, else where fewest of this instance are, then where most is free;
  // on one to be avoided only if no other has room.
  absl::StatusOr<RegionId> AddRegion(const std::string& wished) {
    std::map<std::string, int> here;
    for (const records::Placement& placement : next_.placements()) ++here[placement.host_id()];
    FreeHost* best = nullptr;
    for (FreeHost& host : hosts_) {
      if (host.free == 0) continue;
      const auto rank = [&](const FreeHost& h) {
        return std::tuple(h.avoided, h.id != wished, here[h.id], -static_cast<std::int64_t>(h.free));
      };
      if (best == nullptr || rank(host) < rank(*best)) best = &host;
    }
    const std::uint32_t id = FreeId();
    if (best == nullptr) {
      return absl::ResourceExhaustedError(absl::StrCat("region ", id, " needs a place; no ready host has one free"));
    }
    if (id > kMaxRegions) return absl::ResourceExhaustedError(absl::StrCat("more than ", kMaxRegions, " regions"));
    --best->free;
    records::Placement placement;
    placement.set_region(id);
    placement.set_host_id(best->id);
    placement.set_incarnation(next_.last_incarnation() + 1);
    placement.set_joins(true);
    placement.set_unprotected(true);
    next_.set_last_incarnation(placement.incarnation());
    auto& placements = *next_.mutable_placements();
    *placements.Add() = placement;
    std::sort(placements.begin(), placements.end(),
              [](const auto& a, const auto& b) { return a.region() < b.region(); });
    return RegionId(id);
  }

  // Replaces a worker on a host that drains, or one that is to run a newer program. One at a time.
  absl::StatusOr<bool> ReplaceOne() {
    for (const RegionFacts& region : facts_) {
      const bool old = region.incarnation <= record_.replace_up_to();
      if (!old && !region.host_draining) continue;
      const auto newcomer = AddRegion(region.host_draining ? "" : region.host_id);
      if (!newcomer.ok()) return newcomer.status();
      tree_.Replace(RegionId(region.region), *newcomer);
      return true;
    }
    return false;
  }

  // Moves the region that is not to stay on its host, if another has room.
  absl::StatusOr<bool> LeaveHost() {
    const auto leaves =
        std::find_if(facts_.begin(), facts_.end(), [](const RegionFacts& region) { return region.leaves_host; });
    const bool room =
        std::any_of(hosts_.begin(), hosts_.end(), [](const FreeHost& host) { return host.free > 0 && !host.avoided; });
    if (leaves == facts_.end() || !room) return false;
    const auto newcomer = AddRegion("");
    if (!newcomer.ok()) return newcomer.status();
    tree_.Replace(RegionId(leaves->region), *newcomer);
    return true;
  }

  // Hosts die and come back; the regions that took the place of theirs stayed with the others. Moves one region from
  // the fullest host of this instance to its emptiest, or to one that it has nothing on while it is all on one:
  // standbys are to live elsewhere. One at a time, and only if that makes it more even.
  absl::StatusOr<bool> SpreadOne() {
    std::map<std::string, int> here;
    for (const RegionFacts& region : facts_) ++here[region.host_id];
    const bool on_one = here.size() == 1;
    const FreeHost* to = nullptr;
    for (const FreeHost& host : hosts_) {
      if (host.free == 0 || host.avoided || (!on_one && !here.contains(host.id))) continue;
      if (to == nullptr || here[host.id] < here[to->id]) to = &host;
    }
    if (to == nullptr) return false;
    const RegionFacts* from = nullptr;
    for (const RegionFacts& region : facts_) {
      if (from == nullptr || here[region.host_id] > here[from->host_id]) from = &region;
    }
    if (from == nullptr || here[from->host_id] < here[to->id] + 2) return false;
    const auto newcomer = AddRegion(to->id);
    if (!newcomer.ok()) return newcomer.status();
    tree_.Replace(RegionId(from->region), *newcomer);
    return true;
  }

  bool HasCut() const {
    return std::any_of(facts_.begin(), facts_.end(),
                       [](const RegionFacts& region) { return !region.cut_from.empty(); });
  }

  absl::StatusOr<bool> Scale() {
    const std::size_t wanted = record_.wanted_regions() == 0 ? map_.regions().size() : record_.wanted_regions();
    bool any = false;
    for (; tree_.Regions().size() < wanted; any = true) {
      const auto newcomer = AddRegion("");
      if (!newcomer.ok()) return newcomer.status();
      const RegionId busiest = ToSplit();
      tree_.Split(busiest, *newcomer);
      loads_[*newcomer] = loads_[busiest] /= 2;
    }
    for (; tree_.Regions().size() > wanted; any = true) {
      const RegionId lightest = tree_.Lightest(loads_);
      const RegionId sibling = tree_.SiblingOf(lightest);
      tree_.Remove(lightest);
      loads_[sibling] += loads_[lightest];
      loads_.erase(lightest);
    }
    return any;
  }

  // A region that has several cells, else the busiest.
  RegionId ToSplit() const {
    const std::vector<RegionId> regions = tree_.Regions();
    const auto rank = [this](RegionId id) { return std::tuple(tree_.Cells(id) > 1, loads_.at(id)); };
    return *std::max_element(regions.begin(), regions.end(), [&](RegionId a, RegionId b) { return rank(a) < rank(b); });
  }

  // Two that join together are not each other's standbys: the one that is left has not stepped, and nobody promotes it.
  CutBetween CutsOrJoins() const {
    std::set<std::uint32_t> joins;
    for (const records::Placement& placement : next_.placements()) {
      if (placement.joins()) joins.insert(placement.region());
    }
    return [cuts = CutsIn(facts_), joins = std::move(joins)](RegionId region, RegionId standby) {
      return (joins.contains(region.value()) && joins.contains(standby.value())) || cuts(region, standby);
    };
  }

  absl::StatusOr<std::optional<records::Instance>> Finish() {
    const MapVersion version = NextVersion(record_);
    const auto wanted = tree_.ToMap(version, map_.regions());
    if (!wanted.ok()) return wanted.status();
    const auto transition = TransitionMap(map_, *wanted, version);
    if (!transition.ok()) return transition.status();
    const auto planned = WithStandbys(*transition, HostsOf(next_), CutsOrJoins());
    if (!planned.ok()) return planned.status();
    const bool same_regions =
        std::equal(planned->regions().begin(), planned->regions().end(), map_.regions().begin(), map_.regions().end());
    if (same_regions && !InTransition(*planned)) return std::nullopt;
    SetPlanned(*planned, next_);
    return std::move(next_);
  }

  const records::Instance& record_;
  std::span<const RegionFacts> facts_;
  std::vector<FreeHost> hosts_;
  PartitionMap map_;
  RegionTree tree_;
  RegionLoads loads_;
  RegionSpreads spreads_;
  records::Instance next_;
};

}  // namespace

std::optional<records::Instance> StepPlan(const records::Instance& record, std::span<const RegionFacts> facts) {
  if (!record.has_planned()) {
    auto settled = Settle(record, facts);
    return settled ? std::move(settled) : OtherStandbys(record, facts);
  }
  const v1::PlannedMap& planned = record.planned();
  const std::uint64_t version = planned.map().version(), newest = NewestTick(facts);
  const auto all = [facts](auto&& holds) { return std::all_of(facts.begin(), facts.end(), holds); };
  records::Instance next = record;
  if (planned.effective_tick() == 0) {
    if (!all([](const RegionFacts& region) { return region.bound; })) return std::nullopt;
    next.mutable_planned()->set_effective_tick(newest + LeadTicks(record, facts));
    return next;
  }
  if (!planned.committed()) {
    const bool stands = IsPaused(record);  // a step of a paused world, which nobody makes before all know of it
    if (!stands && newest + FloodTicks(facts) >= planned.effective_tick()) return PutOff(record);
    if (!all([version](const RegionFacts& region) { return region.planned_version >= version; })) return std::nullopt;
    // One that its neighbours refuse would hold up all of them, and nothing takes a committed map back.
    if (!all([](const RegionFacts& region) { return region.unlinked.empty(); })) return std::nullopt;
    next.mutable_planned()->set_committed(true);
    if (stands) next.mutable_clock()->set_resumed_version(record.map().version());
    return next;
  }
  if (all([version](const RegionFacts& region) { return region.map_version >= version; })) return InForce(record);
  // It was refused by all who run: nobody has it, nor will.
  const bool refused =
      all([version](const RegionFacts& region) { return region.newcomer || region.refused_version >= version; });
  if (refused) return PutOff(record);
  return std::nullopt;
}

records::Instance TakenBack(const records::Instance& record) {
  records::Instance next = record;
  next.clear_planned();
  auto& placements = *next.mutable_placements();
  const auto joins = [](const records::Placement& placement) { return placement.joins(); };
  placements.erase(std::remove_if(placements.begin(), placements.end(), joins), placements.end());
  return next;
}

bool AtRest(const records::Instance& record) {
  return !record.has_failover() && !record.has_planned() &&
         std::none_of(record.map().cells().begin(), record.map().cells().end(),
                      [](const v1::Cell& cell) { return cell.from() != 0; });
}

absl::StatusOr<std::optional<records::Instance>> PlanChange(const records::Instance& record,
                                                            std::span<const RegionFacts> facts,
                                                            std::span<const FreeHost> hosts) {
  auto map = FromProto(record.map());
  if (!map.ok()) return map.status();
  auto tree = RegionTree::FromMap(*map);
  if (!tree.ok()) return tree.status();
  return Planner(record, facts, hosts, *std::move(map), *std::move(tree)).Plan();
}

std::string DescribePlan(const records::Instance& record) {
  if (record.has_planned()) {
    const v1::PlannedMap& planned = record.planned();
    if (planned.effective_tick() == 0) {
      return absl::StrCat("map ", planned.map().version(), ": new workers start");
    }
    return absl::StrCat("map ", planned.map().version(), " at tick ", planned.effective_tick(),
                        planned.committed() ? "" : ": being announced");
  }
  return AtRest(record) ? "" : absl::StrCat("map ", record.map().version(), ": bodies move to their new regions");
}

}  // namespace tessera::control
