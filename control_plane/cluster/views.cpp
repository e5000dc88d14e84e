#include "control_plane/cluster/views.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/change.h"
#include "control_plane/control_settings.h"
#include "control_plane/failover.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/one_line.h"
#include "control_plane/region_tree.h"
#include "control_plane/standbys.h"
#include "control_plane/world_terms.h"
#include "core/region/settings.h"

namespace tessera::control {
namespace {

constexpr int kMostNamedWaits = 3;

// While bodies move to their new regions: which regions still have some of another's, and which acknowledge none.
std::string DescribeWait(const InstanceEntry& instance) {
  std::string text = instance.links_awaited.empty() ? "" : absl::StrCat("; waits: ", instance.links_awaited);
  for (const WorkerEntry& worker : instance.workers) {
    if (const std::uint64_t outside = worker.report.bodies_outside(); outside > 0) {
      absl::StrAppend(&text, "; region ", worker.region, " has ", outside, " to hand over");
    }
    if (worker.report.unprotected()) {
      absl::StrAppend(&text, "; region ", worker.region,
                      " is unprotected and acknowledges nothing: its standby, region ",
                      StandbyOf(instance.record, worker.region), ", does not take its log");
    }
  }
  return text;
}

// Before it runs: its workers that are not ready, and its players who are not in.
std::string DescribeStart(const ClusterState& state, const InstanceEntry& instance) {
  const records::Instance& record = instance.record;
  std::string text = "starts";
  // Before, nobody has been ordered to begin one.
  const bool ordered = WantsWorkers(record.state());
  int late = 0;
  for (std::size_t i = 0; ordered && i < instance.workers.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    if (worker.report.phase() >= v1::WORKER_PHASE_LINKED || worker.gone || ++late > kMostNamedWaits) continue;
    const HostEntry* host = HostAt(state, instance, i);
    absl::StrAppend(&text, late == 1 ? ": waits for region " : ", region ", worker.region, " on ",
                    host == nullptr ? "no host" : host->record.name(),
                    !worker.reported ? ", which has not begun"
                    : worker.bound() ? ", which links"
                                     : ", which loads");
  }
  if (late > kMostNamedWaits) absl::StrAppend(&text, " and ", late - kMostNamedWaits, " more");
  const bool awaited = instance.players.present() < record.expected_players();
  if (late == 0 && awaited && record.state() != v1::INSTANCE_STATE_PLACING) {
    absl::StrAppend(&text, ": waits for players, ", instance.players.present(), " of ", record.expected_players(),
                    " are in");
  }
  return text;
}

void AddChange(const ClusterState& state, const InstanceEntry& instance, v1::Instance& view) {
  const records::Instance& record = instance.record;
  v1::InstanceChange change;
  std::chrono::nanoseconds since = instance.waits.empty() ? std::chrono::nanoseconds(0) : instance.waits_since;
  if (!instance.restore_wanted.empty() && WantsWorkers(record.state())) {
    change.set_text(absl::StrCat("is to begin again from a checkpoint: ", instance.restore_wanted));
    if (!instance.restore_waits.empty()) absl::StrAppend(change.mutable_text(), "; waits: ", instance.restore_waits);
    change.set_version(record.map().version());
  } else if (record.has_failover()) {
    change.set_text(absl::StrCat("failover of ", DescribeFailover(record.failover()),
                                 instance.awaits.empty() ? "" : "; ", instance.awaits));
    change.set_version(record.map().version());
  } else if (const std::string plan = DescribePlan(record); !plan.empty()) {
    change.set_text(absl::StrCat(plan, DescribeWait(instance)));
    change.set_version(record.has_planned() ? record.planned().map().version() : record.map().version());
    change.set_effective_tick(record.planned().effective_tick());
  } else if (IsStarting(record.state())) {
    change.set_text(DescribeStart(state, instance));
    change.set_version(record.map().version());
  } else if (!instance.lacks_room.empty() && record.state() == v1::INSTANCE_STATE_RUNNING) {
    change.set_text(instance.lacks_room);
    change.set_version(record.map().version());
    change.set_lacks_room(true);
    since = instance.lacks_room_since;
  } else if (!instance.taken_back.empty() && record.state() == v1::INSTANCE_STATE_RUNNING) {
    change.set_text(instance.taken_back);
    change.set_version(record.map().version());
  } else {
    return;
  }
  if (!instance.trouble.empty()) *change.mutable_text() += "; " + OneLine(instance.trouble, kMaxReasonBytes);
  if (since.count() != 0) *change.mutable_since() = ToTimestamp(since);
  *view.add_changes() = std::move(change);
}

void AddLoads(const InstanceEntry& instance, v1::Instance& view) {
  for (const WorkerEntry& worker : instance.workers) {
    if (IsUnprotected(instance, worker)) view.add_unprotected_regions(worker.region);
  }
  view.set_imbalance(ImbalanceOf(instance));
}

// As the scene has them, and as the newest owner of the world's record has reported them.
void AddWorldProperties(const InstanceEntry& instance, v1::Instance& view) {
  *view.mutable_world_properties() = instance.record.world_properties();
  const WorkerEntry* newest = nullptr;
  for (const WorkerEntry& worker : instance.workers) {
    if (worker.gone || !worker.reported || worker.report.world_properties().empty()) continue;
    if (newest == nullptr || worker.report.world_epoch() > newest->report.world_epoch()) newest = &worker;
  }
  if (newest == nullptr) return;
  for (v1::Property& property : *view.mutable_world_properties()) {
    for (const v1::Property& reported : newest->report.world_properties()) {
      if (reported.name() != property.name() || reported.value_case() != property.value_case()) continue;
      const v1::Visibility visible_to = property.visible_to();
      property = reported;
      property.set_visible_to(visible_to);
    }
  }
}

void AddRegions(const ClusterState& state, const InstanceEntry& instance, v1::Instance& view) {
  const records::Instance& record = instance.record;
  for (int i = 0; i < record.placements_size(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    const bool has_worker = index < instance.workers.size();  // a draft has none
    if (has_worker && instance.workers[index].gone) continue;
    v1::RegionStatus& status = *view.add_region_status();
    status.set_region(record.placements(i).region());
    if (const HostEntry* host = HostAt(state, instance, index)) status.set_host(host->record.name());
    if (!has_worker || !instance.workers[index].reported) continue;
    *status.mutable_report() = instance.workers[index].report;
    status.mutable_report()->clear_game_lines();   // ListGameLines has them
    status.mutable_report()->clear_game_events();  // WatchGameEvents has them
    status.mutable_report()->clear_world_properties();
  }
}

}  // namespace

bool IsUnprotected(const InstanceEntry& instance, const WorkerEntry& worker) {
  const bool has_others = instance.record.map().regions_size() > 1;
  return worker.report.unprotected() || (has_others && StandbyOf(instance.record, worker.region) == 0);
}

double ImbalanceOf(const InstanceEntry& instance) {
  RegionLoads loads;
  for (const WorkerEntry& worker : instance.workers) {
    loads[RegionId(worker.region)] = worker.report.step().p50_seconds();
  }
  const bool measured = std::all_of(loads.begin(), loads.end(), [](const auto& load) { return load.second > 0; });
  return measured && !loads.empty() ? Imbalance(loads) : 0;
}

v1::InstanceState StateOf(const InstanceEntry& instance) {
  const bool degraded = instance.record.state() == v1::INSTANCE_STATE_RUNNING && !instance.degraded.empty();
  if (degraded) return v1::INSTANCE_STATE_DEGRADED;
  const bool paused = instance.record.state() == v1::INSTANCE_STATE_RUNNING && IsPaused(instance.record);
  return paused ? v1::INSTANCE_STATE_PAUSED : instance.record.state();
}

v1::Instance SummaryOf(const InstanceEntry& instance) {
  const records::Instance& record = instance.record;
  v1::Instance view;
  view.set_id(record.id());
  view.set_state(StateOf(instance));
  view.set_reason(instance.degraded.empty() ? record.reason() : instance.degraded);
  if (!instance.degraded.empty()) *view.mutable_degraded_since() = ToTimestamp(instance.degraded_since);
  view.set_scene_name(record.scene_name());
  view.set_scene_hash(record.scene_hash());
  view.set_game_name(record.game_name());
  view.set_game_hash(record.game_hash());
  view.set_game_native(record.game_native());
  if (record.has_movement()) *view.mutable_movement() = record.movement();
  view.set_game_number(record.map().terms().game());
  view.set_game_since_tick(record.games().since_tick());
  view.set_next_game_hash(record.games().next().hash());
  view.set_game_refused(record.games().refused());
  view.set_ticks_per_second(PaceOf(record));
  view.set_regions(static_cast<std::uint32_t>(record.placements_size()));
  view.set_expected_players(record.expected_players());
  view.set_max_players(MaxPlayersOf(record));
  view.set_release(record.release());
  view.set_players(static_cast<std::uint32_t>(instance.players.present()));
  view.set_snapshot_rate_hz(record.snapshot_rate_hz());
  *view.mutable_borders() = record.borders();
  view.set_region_threads(RegionThreadsOf(record));
  // Records made before there were such settings lack them.
  if (!record.borders().has_ghost_depth())
    view.mutable_borders()->set_ghost_depth(region::RegionSettings().ghost_depth);
  if (!record.borders().has_whole_up_to())
    view.mutable_borders()->set_whole_up_to(region::RegionSettings().whole_up_to);
  view.set_guests(!record.no_guests());
  *view.mutable_create_time() = record.create_time();
  if (record.has_start_time()) *view.mutable_start_time() = record.start_time();
  view.set_revision(static_cast<std::uint64_t>(instance.revision));
  view.set_operation(record.operation());
  view.set_wanted_regions(record.wanted_regions() == 0 ? view.regions() : record.wanted_regions());
  view.set_failovers(record.failovers());
  view.set_lost_bodies(record.lost_bodies());
  view.set_lost_ticks(record.lost_ticks());
  view.set_lost_ticks_at_least(record.lost_ticks_at_least());
  if (record.has_lost_time()) *view.mutable_lost_time() = record.lost_time();
  return view;
}

v1::Instance ViewOf(const ClusterState& state, const InstanceEntry& instance) {
  const records::Instance& record = instance.record;
  v1::Instance view = SummaryOf(instance);
  AddChange(state, instance, view);
  AddLoads(instance, view);
  *view.mutable_events() = record.events();
  *view.mutable_checkpoints() = record.checkpoints();
  *view.mutable_map() = record.map();
  for (const records::StoredPlayer* known : instance.players.All()) *view.add_player_list() = known->player();
  *view.mutable_properties() = record.properties();
  AddWorldProperties(instance, view);
  AddRegions(state, instance, view);
  return view;
}

}  // namespace tessera::control
