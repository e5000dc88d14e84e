#include "control_plane/instance_record.h"

#include <algorithm>

#include "control_plane/branches.h"
#include "control_plane/checkpoint_files.h"
#include "control_plane/control_settings.h"
#include "control_plane/game_deaths.h"
#include "control_plane/id_ranges.h"
#include "control_plane/one_line.h"
#include "control_plane/world_terms.h"
#include "core/world/partition_io.h"
#include "core/world/spawned_id.h"

namespace tessera::control {
namespace {

void SetPlacements(const PlacementPlan& placed, records::Instance& record) {
  record.clear_placements();
  for (const PlacedRegion& region : placed.regions) {
    records::Placement& placement = *record.add_placements();
    placement.set_region(region.region.value());
    placement.set_host_id(region.host_id);
    placement.set_incarnation(record.last_incarnation() + 1);
    record.set_last_incarnation(placement.incarnation());
  }
  *record.mutable_map() = ToProto(placed.map);
}

}  // namespace

records::Instance NewInstance(const InstancePlan& plan, const PlacementPlan& placed, Now now) {
  records::Instance record;
  record.set_request_id(plan.request_id);
  record.set_state(plan.lazy ? v1::INSTANCE_STATE_PENDING : v1::INSTANCE_STATE_STARTING);
  record.set_scene_name(plan.scene_name);
  record.set_scene_hash(plan.scene_hash);
  record.set_game_name(plan.game_name);
  record.set_game_hash(plan.game_hash);
  record.set_game_native(plan.game_native);
  if (plan.movement) *record.mutable_movement() = *plan.movement;
  record.set_tick_rate_hz(plan.tick_rate_hz);
  record.set_expected_players(plan.expected_players);
  record.set_max_players(plan.max_players);
  record.set_start_deadline_ms(plan.start_deadline.count());
  record.set_snapshot_rate_hz(plan.snapshot_rate_hz);
  *record.mutable_borders() = plan.borders;
  record.set_region_threads(plan.region_threads);
  record.set_lazy(plan.lazy);
  record.set_no_guests(!plan.guests);
  record.set_balance(plan.balance);
  record.set_checkpoint_interval_ms(plan.checkpoint_interval.count());
  record.set_keep_checkpoints(plan.keep_checkpoints);
  record.set_leaver_policy(plan.leaver_policy);
  record.set_leaver_grace_ms(static_cast<std::uint32_t>(plan.leaver_grace.count()));
  *record.mutable_bodies() = ToRanges(plan.bodies);
  SetPlacements(placed, record);
  record.set_wanted_regions(static_cast<std::uint32_t>(record.placements_size()));
  *record.mutable_properties() = {plan.properties.begin(), plan.properties.end()};
  record.set_properties_taken(true);
  *record.mutable_world_properties() = {plan.world_properties.begin(), plan.world_properties.end()};
  record.set_world_properties_taken(true);
  *record.mutable_visuals() = {plan.visuals.begin(), plan.visuals.end()};
  record.set_visuals_taken(true);
  for (const Vec3d& point : plan.spawn_points) {
    v1::Vec3& stored = *record.add_spawn_points();
    stored.set_x(point.x);
    stored.set_y(point.y);
    stored.set_z(point.z);
  }
  *record.mutable_create_time() = ToTimestamp(now.unix_time);
  return plan.restored ? RestoredFrom(record, *plan.restored, placed) : record;
}

records::Instance PlacedAnew(const records::Instance& record, const PlacementPlan& placed) {
  records::Instance next = record;
  SetPlacements(placed, next);
  return next;
}

records::Instance RestoredFrom(const records::Instance& record, const records::Manifest& manifest,
                               const PlacementPlan& placed) {
  records::Instance next = record;
  const std::uint64_t version = std::max(record.last_map_version(), record.map().version()) + 1;
  SetPlacements(placed, next);
  next.mutable_map()->set_version(version);
  next.set_last_map_version(version);
  // The world is as it was, with its game; whether it stands still, and how fast it goes, is as it is wanted now.
  v1::WorldTerms terms = manifest.map().terms();
  terms.set_paused(record.clock().paused());
  terms.set_ticks_per_second(record.clock().ticks_per_second());
  SetTerms(terms, *next.mutable_map());
  if (!manifest.game_hash().empty()) {
    next.set_game_name(manifest.game_name());
    next.set_game_hash(manifest.game_hash());
    next.set_game_native(manifest.game_native());
    next.clear_movement();
    if (manifest.has_movement()) *next.mutable_movement() = manifest.movement();
  }
  FollowRestore(record, manifest.tick(), next);
  next.clear_games();
  next.set_state(v1::INSTANCE_STATE_STARTING);
  next.set_run(false);
  next.clear_failover();
  next.clear_planned();
  records::Restored& restored = *next.mutable_restored();
  restored.Clear();
  restored.set_tick(manifest.tick());
  restored.set_last_incarnation(next.last_incarnation());
  BeginBranch(manifest, next);
  for (const PlacedRegion& region : placed.regions) {
    for (const records::ManifestFile& file : manifest.files()) {
      if (file.name() != RegionFileName(region.region.value())) continue;
      records::RegionFile& added = *restored.add_files();
      added.set_region(region.region.value());
      added.set_hash(file.hash());
    }
  }
  return next;
}

records::Instance Failed(const records::Instance& record, const std::string& why, Now now) {
  records::Instance next = record;
  next.set_state(v1::INSTANCE_STATE_FAILED);
  next.set_reason(OneLine(why, kMaxReasonBytes));
  next.clear_failover();
  next.clear_planned();
  *next.mutable_end_time() = ToTimestamp(now.unix_time);
  return next;
}

void AddEvent(records::Instance& record, Now now, const std::string& text) {
  v1::InstanceEvent& event = *record.add_events();
  *event.mutable_time() = ToTimestamp(now.unix_time);
  event.set_text(OneLine(text, kMaxReasonBytes));
  if (record.events_size() > kMaxEvents) record.mutable_events()->DeleteSubrange(0, record.events_size() - kMaxEvents);
}

bool HasBody(const records::Instance& record, const Players& players, BodyId body) {
  if (IsSpawned(body)) return true;  // which ones there are, the regions know
  if (!IsPlayerBody(body)) return Contains(record.bodies(), body);
  const records::StoredPlayer* known = players.Find(PlayerOf(body).value());
  return known != nullptr && !known->player().left();
}

std::uint32_t RegionThreadsOf(const records::Instance& record) {
  return std::max<std::uint32_t>(1, record.region_threads());
}

std::uint32_t MaxPlayersOf(const records::Instance& record) {
  return record.max_players() == 0 ? kUsualPlayers : record.max_players();
}

std::uint32_t SpawnRegionOf(std::uint32_t player, const records::Instance& record, const PartitionMap& map) {
  const auto points = static_cast<std::uint32_t>(record.spawn_points_size());
  const v1::Vec3& place = record.spawn_points(static_cast<int>((player - 1) % points));
  return map.OwnerOf({place.x(), place.y(), place.z()}).value();
}

}  // namespace tessera::control
