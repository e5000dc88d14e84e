#include "control_plane/adopt.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace tessera::control {
namespace {

// A newcomer's order has a plan that is not decided yet, so others go first.
const HeldOrder& NewestOf(std::span<const HeldOrder> orders) {
  return *std::max_element(orders.begin(), orders.end(), [](const HeldOrder& a, const HeldOrder& b) {
    const auto age = [](const HeldOrder& held) {
      return std::tuple(!held.order.joins_running(), held.order.map().version(), held.order.planned().map().version(),
                        held.order.revision());
    };
    return age(a) < age(b);
  });
}

// The hosts that run a region. The one with the highest incarnation does.
class Places {
 public:
  void Add(std::uint32_t region, std::uint64_t incarnation, const std::string& host_id, bool joins) {
    records::Placement& place = by_region_[region];
    if (incarnation <= place.incarnation()) return;
    place.set_region(region);
    place.set_incarnation(incarnation);
    place.set_host_id(host_id);
    place.set_joins(joins);
  }
  bool Has(std::uint32_t region) const { return by_region_.contains(region); }
  const records::Placement& At(std::uint32_t region) const { return by_region_.at(region); }

 private:
  std::map<std::uint32_t, records::Placement> by_region_;
};

std::set<std::uint32_t> RegionsOf(const v1::PartitionMap& map) {
  std::set<std::uint32_t> regions;
  for (const v1::MapRegion& region : map.regions()) regions.insert(region.id());
  return regions;
}

std::string OldHostOf(const records::Instance& old, std::uint32_t region) {
  for (const records::Placement& before : old.placements()) {
    if (before.region() == region) return before.host_id();
  }
  return old.placements().empty() ? "" : old.placements(0).host_id();
}

// The incarnations that peers are known by, where no order of theirs is.
void AddPeers(const records::Instance& old, const v1::WorkerOrder& order, const HostOfAddress& host_at,
              Places& places) {
  for (const v1::RegionAddress& peer : order.peers()) {
    std::string host_id = host_at(peer.host());
    if (host_id.empty()) host_id = OldHostOf(old, peer.region());
    for (const records::Placement& before : old.placements()) {
      if (before.region() == peer.region() && before.incarnation() == peer.incarnation()) host_id = before.host_id();
    }
    places.Add(peer.region(), peer.incarnation(), host_id, false);
  }
}

// The incarnation under which the region ran last, as far as anybody knows; 0: nobody does.
std::uint64_t LastIncarnationOf(const records::Instance& old, const CopiesHeld& copies, std::uint32_t region) {
  const auto copy = copies.find(region);
  // Numbers of the old record were raised beyond all that were given since.
  if (copy != copies.end() && copy->second <= old.last_incarnation()) return copy->second;
  for (const records::Placement& before : old.placements()) {
    if (before.region() == region) return before.incarnation();
  }
  return 0;
}

void SetPlacements(const records::Instance& old, const CopiesHeld& copies, const Places& places,
                   records::Instance& next) {
  const std::set<std::uint32_t> in_force = RegionsOf(next.map());
  std::set<std::uint32_t> regions = in_force;
  for (const std::uint32_t planned : RegionsOf(next.planned().map())) regions.insert(planned);
  next.clear_placements();
  for (const std::uint32_t region : regions) {
    records::Placement& place = *next.add_placements();
    if (places.Has(region)) {
      place = places.At(region);
      // It had nobody's copy yet when it was ordered to begin, and its map may have come into force since.
      place.set_unprotected(place.joins());
      place.set_joins(place.joins() && !in_force.contains(region));
    } else {
      place.set_region(region);
      place.set_host_id(OldHostOf(old, region));
      const std::uint64_t known = LastIncarnationOf(old, copies, region);
      place.set_incarnation(known != 0 ? known : next.last_incarnation() + 1);
    }
    next.set_last_incarnation(std::max(next.last_incarnation(), place.incarnation()));
  }
}

// The failover goes on from its beginning: its inventories are asked for again.
void SetFailover(const v1::WorkerOrder& newest, std::span<const HeldOrder> orders, records::Instance& next) {
  next.clear_failover();
  for (const v1::DeadRegion& dead : newest.failover().dead()) {
    records::Dead& entry = *next.mutable_failover()->add_dead();
    entry.set_region(dead.region());
    entry.set_incarnation(dead.incarnation());
    entry.set_host_id(OldHostOf(next, dead.region()));
    for (const HeldOrder& held : orders) {
      const auto& copies = held.order.primaries();
      if (std::find(copies.begin(), copies.end(), dead.region()) != copies.end())
        entry.set_standby(held.order.region());
    }
  }
  if (next.has_failover() && newest.has_resolution()) {
    *next.mutable_failover()->mutable_resolution() = newest.resolution();
    for (records::Dead& dead : *next.mutable_failover()->mutable_dead()) dead.set_resolved(true);
  }
}

// The map towards which the world was on its way. A plan whose newcomers still start is in their orders alone, and is
// given up, to be made anew.
const v1::PartitionMap& LastMap(std::span<const HeldOrder> orders, const records::Instance& next) {
  const v1::PartitionMap* last = next.has_planned() ? &next.planned().map() : &next.map();
  for (const HeldOrder& held : orders) {
    const v1::PartitionMap& planned = held.order.planned().map();
    if (held.order.joins_running() && planned.version() > last->version()) last = &planned;
  }
  return *last;
}

// As many as there are once nothing is under way: so whoever dies from now on, or died a moment ago, is replaced. One
// that leaves owns no cells any more.
void SetWanted(std::span<const HeldOrder> orders, records::Instance& next) {
  std::set<std::uint32_t> regions;
  for (const v1::Cell& cell : LastMap(orders, next).cells()) regions.insert(cell.owner());
  next.set_wanted_regions(static_cast<std::uint32_t>(regions.size()) +
                          static_cast<std::uint32_t>(next.failover().dead_size()));
}

void SetGame(const v1::WorkerOrder& newest, records::Instance& next) {
  next.set_game_name(newest.game_name());
  next.set_game_hash(newest.game_hash());
  next.set_game_native(newest.game_native());
  next.clear_movement();
  if (!newest.movement_name().empty()) {
    next.mutable_movement()->set_name(newest.movement_name());
    next.mutable_movement()->set_hash(newest.movement_hash());
  }
  next.mutable_games()->clear_next();
}

// It may have been upgraded since. Orders of a control plane that knew of no releases name none.
void SetReleaseOf(const v1::WorkerOrder& newest, records::Instance& next) {
  if (!newest.release().empty()) next.set_release(newest.release());
}

void SetLastPlayer(const v1::WorkerOrder& newest, records::Instance& next) {
  for (const v1::Player& player : newest.players()) next.set_last_player(std::max(next.last_player(), player.number()));
}

void SetClock(const v1::WorkerOrder& newest, records::Instance& next) {
  records::Clock& clock = *next.mutable_clock();
  clock.set_resumed_version(newest.resumed_version());
  clock.set_paused(newest.map().terms().paused() && newest.resumed_version() < newest.map().version());
  clock.set_ticks_per_second(newest.map().terms().ticks_per_second());
}

}  // namespace

records::Instance AdoptOrders(const records::Instance& old, std::span<const HeldOrder> orders, const CopiesHeld& copies,
                              const HostOfAddress& host_at) {
  const v1::WorkerOrder& newest = NewestOf(orders).order;
  records::Instance next = old;
  *next.mutable_map() = newest.map();
  next.clear_planned();
  next.set_replace_up_to(0);
  if (newest.planned().effective_tick() != 0 && !newest.joins_running()) {
    *next.mutable_planned() = newest.planned();
  }
  Places places;
  for (const HeldOrder& held : orders) {
    places.Add(held.order.region(), held.order.incarnation(), held.host_id, held.order.joins_running());
  }
  for (const HeldOrder& held : orders) AddPeers(old, held.order, host_at, places);
  SetPlacements(old, copies, places, next);
  next.set_last_map_version(
      std::max({old.last_map_version(), newest.map().version(), newest.planned().map().version()}));
  SetFailover(newest, orders, next);
  SetWanted(orders, next);
  SetGame(newest, next);
  SetReleaseOf(newest, next);
  SetLastPlayer(newest, next);
  SetClock(newest, next);
  next.set_snapshot_rate_hz(newest.snapshot_rate_hz());
  next.set_expected_players(newest.expected_players());
  next.set_max_players(newest.max_players());
  *next.mutable_borders() = newest.borders();
  next.set_region_threads(newest.region_threads());
  next.clear_reason();
  next.set_run(newest.run());
  if (newest.stop()) {
    next.set_state(v1::INSTANCE_STATE_STOPPING);
  } else if (newest.run()) {
    next.set_state(v1::INSTANCE_STATE_RUNNING);
  } else {
    next.set_state(v1::INSTANCE_STATE_STARTING);
  }
  return next;
}

Players AdoptPlayers(const Players& old, std::span<const HeldOrder> orders) {
  Players next;
  for (const v1::Player& named : NewestOf(orders).order.players()) {
    const records::StoredPlayer* before = old.Find(named.number());
    records::StoredPlayer known = before == nullptr ? records::StoredPlayer() : *before;
    v1::Player& player = *known.mutable_player();
    player.set_number(named.number());
    player.set_generation(named.generation());
    player.set_spawn_region(named.spawn_region());
    player.set_left(named.left());
    player.set_parked(named.parked());
    player.set_ended_because(named.ended_because());
    if (named.number() != 0) next.Put(std::move(known));
  }
  for (const HeldOrder& held : orders) {
    for (const v1::Player& named : held.order.players()) {
      if (named.spawn_region() != held.order.region()) continue;
      next.Change(named.number(), [&](records::StoredPlayer& known) {
        if (!named.name().empty()) known.mutable_player()->set_name(named.name());
        if (!named.properties().empty()) *known.mutable_player()->mutable_properties() = named.properties();
      });
    }
  }
  return next;
}

}  // namespace tessera::control
