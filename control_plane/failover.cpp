#include "control_plane/failover.h"

#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/id_ranges.h"
#include "control_plane/instance_record.h"
#include "control_plane/world_terms.h"
#include "core/region/failover_io.h"
#include "core/world/partition_change.h"
#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

// The map to start from: once a planned map is committed, some may run by it already, or soon will.
const v1::PartitionMap& BaseMap(const records::Instance& record) {
  return record.planned().committed() ? record.planned().map() : record.map();
}

bool InMap(const v1::PartitionMap& map, std::uint32_t region) { return FindRegion(map, RegionId(region)) != nullptr; }

const records::Dead* FindDead(const records::Failover& failover, std::uint32_t region) {
  const auto found = std::find_if(failover.dead().begin(), failover.dead().end(),
                                  [region](const records::Dead& dead) { return dead.region() == region; });
  return found == failover.dead().end() ? nullptr : &*found;
}

std::vector<RegionId> DeadRegions(const records::Failover& failover) {
  std::vector<RegionId> dead;
  dead.reserve(static_cast<std::size_t>(failover.dead_size()));
  for (const records::Dead& entry : failover.dead()) dead.emplace_back(entry.region());
  return dead;
}

// True if the bodies of the dead have not been promoted yet.
bool Unresolved(const records::Instance& record) {
  return record.has_failover() && !record.failover().has_resolution();
}

void DeclareDead(const records::Instance& before, const Death& death, records::Instance& next) {
  const auto& placements = before.placements();
  const auto placed = std::find_if(placements.begin(), placements.end(), [&](const records::Placement& p) {
    return p.region() == death.region && p.incarnation() == death.incarnation;
  });
  if (placed == placements.end()) return;
  if (InMap(BaseMap(before), death.region)) {  // else it has no part in the world yet, or any more
    records::Dead& dead = *next.mutable_failover()->add_dead();
    dead.set_region(death.region);
    dead.set_incarnation(death.incarnation);
    dead.set_host_id(placed->host_id());
    dead.set_exit_seen(death.exit_seen);
    dead.set_standby(StandbyOf(before, death.region));
    dead.set_newcomer(placed->unprotected());
  }
  auto& kept = *next.mutable_placements();
  kept.erase(std::remove_if(kept.begin(), kept.end(),
                            [&](const records::Placement& p) { return p.incarnation() == death.incarnation; }),
             kept.end());
}

// Newcomers of a plan that is given up, which are in no map, end again.
void DropUnmapped(records::Instance& next) {
  auto& placements = *next.mutable_placements();
  placements.erase(std::remove_if(placements.begin(), placements.end(),
                                  [&](const records::Placement& p) { return !InMap(next.map(), p.region()); }),
                   placements.end());
}

// True if the world can go on although nobody has a copy of these regions. A newcomer acknowledges nothing before its
// standby has a copy, so all that it was granted is still with those who granted it. If a region was resolved before,
// its standby may own all.
bool HadNothingOfItsOwn(const records::Failover& failover, std::span<const RegionId> regions) {
  return std::all_of(regions.begin(), regions.end(), [&](RegionId region) {
    const records::Dead* dead = FindDead(failover, region.value());
    return dead != nullptr && (dead->newcomer() || dead->resolved());
  });
}

}  // namespace

std::vector<std::uint32_t> BeyondFailover(const records::Instance& record, const std::vector<Death>& deaths) {
  std::map<std::uint32_t, std::uint32_t> standby_of;
  std::set<std::uint32_t> newcomers;  // bodies that they were granted are still with the granter
  if (Unresolved(record)) {
    for (const records::Dead& dead : record.failover().dead()) {
      if (dead.resolved()) continue;  // its missing bodies are found when it is resolved
      standby_of[dead.region()] = dead.standby();
      if (dead.newcomer()) newcomers.insert(dead.region());
    }
  }
  for (const records::Placement& placement : record.placements()) {
    if (placement.unprotected()) newcomers.insert(placement.region());
  }
  for (const Death& death : deaths) {
    if (InMap(BaseMap(record), death.region)) standby_of[death.region] = StandbyOf(record, death.region);
  }
  std::vector<std::uint32_t> beyond;
  for (const auto& [region, standby] : standby_of) {
    if (newcomers.contains(region)) continue;
    if (standby == 0 || standby_of.contains(standby)) beyond.push_back(region);
  }
  return beyond;
}

absl::StatusOr<records::Instance> BeginFailover(const records::Instance& record, const std::vector<Death>& deaths,
                                                const CutBetween& cut, Now now) {
  const auto base = FromProto(BaseMap(record));
  if (!base.ok()) return base.status();
  records::Instance next = record;
  // Whoever has not resumed still has the copies, and whoever has resumed owns what was in them: the next inventories
  // show which.
  if (record.failover().has_resolution()) {
    next = MaybeResolved(record);
    next.mutable_failover()->clear_resolution();
  }
  std::vector<RegionId> dead;
  for (const Death& death : deaths) {
    DeclareDead(record, death, next);
    if (InMap(BaseMap(record), death.region)) dead.emplace_back(death.region);
  }
  if (dead.empty() && !deaths.empty()) {
    next.clear_failover();
    if (record.has_failover()) *next.mutable_failover() = record.failover();
    if (record.planned().committed()) return next;  // it leaves them out: they owned nothing any more
    next.clear_planned();                           // they were newcomers
    DropUnmapped(next);
    return next;
  }
  const std::uint64_t version = std::max(record.last_map_version(), base->version().value()) + 1;
  const auto map = FailoverMap(*base, dead, MapVersion(version));
  if (!map.ok()) return map.status();
  const auto with_standbys = WithStandbys(*map, HostsOf(record), cut);
  if (!with_standbys.ok()) return with_standbys.status();
  // Whoever had the planned map in force goes by its terms already.
  const v1::WorldTerms terms = record.planned().committed() ? record.planned().map().terms() : TermsOf(record);
  AdoptTerms(BaseMap(record), record.planned().effective_tick(), next);
  *next.mutable_map() = ToProto(*with_standbys);
  SetTerms(terms, *next.mutable_map());
  next.set_last_map_version(version);
  next.clear_planned();
  DropUnmapped(next);
  for (records::Placement& placement : *next.mutable_placements()) placement.set_joins(false);
  if (!next.failover().has_begin_time()) *next.mutable_failover()->mutable_begin_time() = ToTimestamp(now.unix_time);
  return next;
}

absl::StatusOr<region::Resolution> ResolveFailover(const records::Instance& record, const Inventories& living) {
  const auto map = FromProto(record.map());
  if (!map.ok()) return map.status();
  std::vector<region::Inventory> inventories;
  inventories.reserve(living.size());
  for (const auto& [region, inventory] : living) {
    auto read = region::FromProto(inventory);
    if (!read.ok()) return read.status();
    inventories.push_back(*std::move(read));
  }
  auto resolution = region::Resolve(*map, DeadRegions(record.failover()), inventories, ToIds(record.bodies()));
  if (!resolution.ok()) return resolution.status();
  const bool nothing_missing =
      resolution->lost.empty() && HadNothingOfItsOwn(record.failover(), resolution->without_copy);
  if (!resolution->without_copy.empty() && !nothing_missing) {
    return absl::DataLossError(
        absl::StrCat("no region has a whole copy of region ",
                     absl::StrJoin(resolution->without_copy, ", ",
                                   [](std::string* out, RegionId region) { absl::StrAppend(out, region.value()); })));
  }
  return *std::move(resolution);
}

records::Instance WithResolution(const records::Instance& record, const region::Resolution& resolution, Now now) {
  records::Instance next = record;
  *next.mutable_failover()->mutable_resolution() = region::ToProto(resolution);
  next.set_failovers(record.failovers() + 1);
  next.set_lost_bodies(record.lost_bodies() + resolution.lost.size());
  if (!resolution.lost.empty()) *next.mutable_lost_time() = ToTimestamp(now.unix_time);
  for (const BodyId body : resolution.lost) TakeOut(body, *next.mutable_bodies());
  return next;
}

// Repeating it is fine: a region makes nobody whom it, or a primary of it, has made.
Players WithNewSpawns(const Players& players, const records::Instance& record, const region::Resolution& resolution) {
  const auto map = FromProto(record.map());
  if (!map.ok() || record.spawn_points().empty()) return players;  // ResolveFailover has read the map
  const std::vector<RegionId> dead = DeadRegions(record.failover());
  Players next = players;
  players.ForEach([&](const records::StoredPlayer& known) {
    const v1::Player& player = known.player();
    const bool orphaned = std::find(dead.begin(), dead.end(), RegionId(player.spawn_region())) != dead.end();
    const bool lives =
        std::binary_search(resolution.players.begin(), resolution.players.end(), PlayerNumber(player.number()));
    if (player.left() || !orphaned || lives) return;
    next.Change(player.number(), [&](records::StoredPlayer& moved) {
      moved.mutable_player()->set_spawn_region(SpawnRegionOf(player.number(), record, *map));
    });
  });
  return next;
}

records::Instance MaybeResolved(const records::Instance& record) {
  records::Instance next = record;
  for (records::Dead& dead : *next.mutable_failover()->mutable_dead()) dead.set_resolved(true);
  return next;
}

records::Instance EndFailover(const records::Instance& record) {
  records::Instance next = record;
  next.clear_failover();
  return next;
}

std::string DescribeFailover(const records::Failover& failover) {
  return absl::StrJoin(failover.dead(), ", ", [](std::string* out, const records::Dead& dead) {
    absl::StrAppend(out, "region ", dead.region(), " to region ", dead.standby());
  });
}

}  // namespace tessera::control
