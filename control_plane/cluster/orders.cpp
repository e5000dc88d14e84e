#include "control_plane/cluster/orders.h"

#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/standbys.h"

namespace tessera::control {

namespace {

void SetFailover(const records::Instance& record, v1::WorkerOrder& order) {
  if (!record.has_failover()) return;
  order.mutable_failover()->set_version(record.map().version());
  for (const records::Dead& dead : record.failover().dead()) {
    v1::DeadRegion& region = *order.mutable_failover()->add_dead();
    region.set_region(dead.region());
    region.set_incarnation(dead.incarnation());
  }
  if (record.failover().has_resolution()) *order.mutable_resolution() = record.failover().resolution();
}

void SetNextGame(const records::Instance& record, v1::WorkerOrder& order) {
  if (!record.games().has_next()) return;
  order.mutable_next_game()->set_hash(record.games().next().hash());
  order.mutable_next_game()->set_name(record.games().next().name());
  order.mutable_next_game()->set_number(record.games().next().number());
}

void SetStandbys(const records::Instance& record, v1::WorkerOrder& order) {
  order.set_standby(StandbyOf(record, order.region()));
  for (const v1::MapRegion& region : record.map().regions()) {
    if (region.standby() == order.region()) order.add_primaries(region.id());
  }
  for (const records::Placement& placement : record.placements()) {
    if (placement.joins() && StandbyOf(record, placement.region()) == order.region())
      order.add_primaries(placement.region());
  }
  // The copies of the dead are promoted.
  for (const records::Dead& dead : record.failover().dead()) {
    if (dead.standby() == order.region()) order.add_primaries(dead.region());
  }
}

void SetInitialState(const records::Instance& record, const records::Placement& placement, v1::WorkerOrder& order) {
  if (placement.incarnation() > record.restored().last_incarnation()) return;
  for (const records::RegionFile& file : record.restored().files()) {
    if (file.region() != placement.region()) continue;
    order.mutable_initial_state()->set_tick(record.restored().tick());
    order.mutable_initial_state()->set_hash(file.hash());
  }
}

void AddPlayer(const v1::Player& player, v1::WorkerOrder& order) {
  v1::Player& named = *order.add_players();
  named.set_number(player.number());
  named.set_generation(player.generation());
  named.set_spawn_region(player.spawn_region());
  named.set_left(player.left());
  named.set_parked(player.parked());
  named.set_ended_because(player.ended_because());
  if (player.spawn_region() != order.region()) return;
  named.set_name(player.name());
  *named.mutable_properties() = player.properties();
}

}  // namespace

v1::WorkerOrder MakeOrder(const InstanceEntry& instance, std::size_t index, const Requests& requests) {
  const records::Instance& record = instance.told ? instance.told->record : instance.record;
  const records::Placement& placement = record.placements(static_cast<int>(index));
  v1::WorkerOrder order;
  order.set_instance_id(record.id());
  order.set_operation(record.operation());
  order.set_region(placement.region());
  order.set_incarnation(placement.incarnation());
  order.set_scene_hash(record.scene_hash());
  order.set_game_hash(record.game_hash());
  order.set_game_name(record.game_name());
  order.set_game_native(record.game_native());
  order.set_movement_name(record.movement().name());
  order.set_movement_hash(record.movement().hash());
  order.set_release(record.release());
  *order.mutable_map() = record.map();
  const net::VerificationKey& key = instance.key.verification_key();
  order.set_instance_key(key.data(), key.size());
  order.set_certificate(instance.workers[index].certificate);
  for (const WorkerEntry& peer : instance.workers) {
    if (peer.region != placement.region() && peer.bound()) *order.add_peers() = peer.report.address();
  }
  order.set_run(record.run());
  order.set_stop(!WantsWorkers(record.state()));
  order.set_snapshot_rate_hz(record.snapshot_rate_hz());
  order.set_expected_players(record.expected_players());
  order.set_max_players(MaxPlayersOf(record));
  *order.mutable_borders() = record.borders();
  order.set_region_threads(RegionThreadsOf(record));
  order.set_joins_running(placement.joins());
  if (record.planned().effective_tick() != 0 || (record.has_planned() && placement.joins())) {
    *order.mutable_planned() = record.planned();
    // A newcomer makes ready before there is a tick, and again when there is.
    if (record.planned().effective_tick() == 0) order.mutable_planned()->set_effective_tick(1);
  }
  order.set_resumed_version(record.clock().resumed_version());
  SetNextGame(record, order);
  SetFailover(record, order);
  SetStandbys(record, order);
  if (requests.checkpoint_tick != 0) order.mutable_checkpoint()->set_tick(requests.checkpoint_tick);
  *order.mutable_property_changes() = {requests.property_changes.begin(), requests.property_changes.end()};
  *order.mutable_backend_messages() = {requests.backend_messages.begin(), requests.backend_messages.end()};
  order.set_published_up_to(requests.published_up_to);
  SetInitialState(record, placement, order);
  return order;
}

const Players& PlayersOf(const InstanceEntry& instance) {
  return instance.told ? instance.told->players : instance.players;
}

void AddPlayers(const Players& players, v1::WorkerOrder& order) {
  order.mutable_players()->Reserve(static_cast<int>(players.size()));
  for (const records::StoredPlayer* known : players.All()) AddPlayer(known->player(), order);
}

void AddPlayerChanges(const Players::Changes& changes, std::uint64_t since, v1::WorkerOrder& order) {
  order.set_players_since(since);
  for (const records::StoredPlayer* known : changes.players) AddPlayer(known->player(), order);
  *order.mutable_players_forgotten() = {changes.forgotten.begin(), changes.forgotten.end()};
}

}  // namespace tessera::control
