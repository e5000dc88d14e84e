#include "region_worker/core/report.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "core/world/proto_math.h"

namespace tessera::worker {
namespace {

constexpr int kMaxRemovedRuns = 10'000;  // runs of ids in a report
constexpr std::size_t kMaxPublishedReported = 512;
constexpr std::size_t kSpreadParts = 16;  // so that a cut is off by a sixteenth of its region's load at most

void AddRemoved(const region::Region& region, v1::WorkerReport& report) {
  for (const BodyId body : region.removed()) {
    const int runs = report.removed_last_size();
    if (runs > 0 && report.removed_last(runs - 1) + 1 == body.value()) {
      report.set_removed_last(runs - 1, body.value());
    } else if (runs < kMaxRemovedRuns) {
      report.add_removed_first(body.value());
      report.add_removed_last(body.value());
    }
  }
}

// The oldest that fit: the rest follows once these are acknowledged.
void AddPublished(const region::Region& region, v1::WorkerReport& report) {
  std::vector<game::Published::Event> events = region.published();
  if (events.size() > kMaxPublishedReported) events.resize(kMaxPublishedReported);
  for (const game::Published::Event& event : events) {
    v1::ReportedGameEvent& out = *report.add_game_events();
    out.set_number(event->number);
    out.set_missed(event->missed);
    out.set_tick(event->tick.value());
    out.set_body(event->source.value());
    out.set_name(event->name);
    out.set_values(event->values.data(), event->values.size());
  }
}

void AddRun(const RegionRun& run, TimePoint now, v1::WorkerReport& report) {
  const region::Region& region = run.region();
  const RunStatistics& statistics = run.statistics();
  report.set_tick(region.tick().value());
  report.set_tick_rate_hz(statistics.rate_hz(now));
  const TimeSummary step = statistics.step_times();
  report.mutable_step()->set_p50_seconds(step.p50_s);
  report.mutable_step()->set_p99_seconds(step.p99_s);
  report.mutable_step()->set_max_seconds(step.max_s);
  report.set_owned(region.owned().size());
  report.set_ghosts(region.ghost_count());
  report.set_asleep(region.asleep_count());
  report.set_map_version(region.map().version().value());
  const TickCounts& counts = statistics.counts();
  report.set_handovers_in(counts.handovers_in);
  report.set_handovers_out(counts.handovers_out);
  report.set_late_ticks(counts.late_ticks);
  report.set_nonfinite_bodies(counts.nonfinite_bodies);
  report.set_spawned_bodies(run.roster().spawned());
  report.set_removed_bodies(counts.removed_bodies);
  for (const BodyId body : statistics.taken_out()) report.add_nonfinite_ids(body.value());
  AddRemoved(region, report);
  report.set_last_gap_ms(run.failover_figures().last_gap_ms);
  report.set_bodies_outside(region.away_count());
  report.set_acknowledged_tick(run.standby_log().acknowledged().value());
  report.set_standby_bytes(run.standby_log().bytes_sent());
  for (const region::RegionCensus& census : statistics.censuses()) {
    v1::Census& out = *report.add_censuses();
    out.set_tick(census.tick.value());
    out.set_owned(census.owned);
    out.set_id_checksum(census.id_checksum);
  }
  AddPublished(region, report);
  run.copies().Report(report);
  run.game_log().Report(report);
}

// All of them, where the world's record is owned here.
void AddWorldProperties(const region::Region& region, v1::WorkerReport& report) {
  const std::vector<PropertyDef>& defs = region.catalog().scene().instance_properties;
  const std::optional<region::WorldProperties> now = region.OwnsWorld() ? region.world_properties() : std::nullopt;
  if (!now || defs.empty()) return;
  const PropertySet changed = PropertySet::Decode(now->bytes, defs).value_or(PropertySet());
  report.set_world_epoch(now->epoch.value());
  for (const PropertyDef& def : defs) {
    *report.add_world_properties() = ToProto(def.name, *ValueOf(defs, {}, changed, def.name));
  }
}

// Positions that part `values` into equal numbers.
void AddQuantiles(std::vector<float>& values, google::protobuf::RepeatedField<float>& out) {
  std::sort(values.begin(), values.end());
  for (std::size_t i = 0; i <= kSpreadParts; ++i) out.Add(values[i * (values.size() - 1) / kSpreadParts]);
}

// Only bodies that are awake count: sleepers cost next to nothing.
void AddSpread(const region::Region& region, v1::WorkerReport& report) {
  std::vector<float> x, z;
  x.reserve(region.owned().size());
  z.reserve(region.owned().size());
  for (const region::OwnedBody& body : region.owned()) {
    if (body.state.asleep) continue;
    x.push_back(static_cast<float>(body.state.position.x));
    z.push_back(static_cast<float>(body.state.position.z));
  }
  if (x.empty()) return;
  AddQuantiles(x, *report.mutable_spread_x());
  AddQuantiles(z, *report.mutable_spread_z());
}

}  // namespace

v1::WorkerReport MakeReport(const v1::WorkerIdentity& identity, const v1::RegionAddress& address,
                            const net::VerificationKey& key, const ReportedState& state, const RegionRun* run,
                            TimePoint now) {
  v1::WorkerReport report;
  *report.mutable_identity() = identity;
  *report.mutable_address() = address;
  report.set_public_key(key.data(), key.size());
  report.set_takes_player_changes(true);
  report.set_phase(state.phase);
  report.set_order_revision(state.order_revision);
  report.set_failure(state.failure);
  for (const RegionId region : state.linked) report.add_linked_regions(region.value());
  for (const PlayerNumber player : state.players) report.add_connected_players(player.value());
  report.set_planned_version(state.planned.value());
  report.set_refused_version(state.refused.value());
  report.set_paused(state.paused);
  report.set_unprotected(state.unprotected);
  report.set_world_paused(state.world_paused);
  if (!state.next_game.empty()) {
    report.mutable_next_game()->set_hash(state.next_game);
    report.mutable_next_game()->set_failure(state.next_game_failure);
  }
  report.set_checkpoint_tick(state.checkpoint_tick.value());
  report.set_checkpoint_failure(state.checkpoint_failure);
  for (const PropertyAnswer& answer : state.property_answers) {
    v1::PropertyAnswer& out = *report.add_property_answers();
    out.set_number(answer.number);
    out.set_refused(answer.refused);
  }
  for (const BackendAnswer& answer : state.backend_answers) {
    v1::BackendAnswer& out = *report.add_backend_answers();
    out.set_number(answer.number);
    out.set_refused(answer.refused);
  }
  for (const region::EndedPlayer& ended : state.ended_players) {
    v1::EndedPlayer& out = *report.add_ended_players();
    out.set_player(ended.player.value());
    out.set_reason(ended.reason);
  }
  if (run != nullptr) {
    AddRun(*run, now, report);
    AddSpread(run->region(), report);
    AddWorldProperties(run->region(), report);
  }
  return report;
}

}  // namespace tessera::worker
