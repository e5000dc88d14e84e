#include "region_worker/worker_metrics.h"

#include <string>
#include <utility>

namespace tessera::worker {
namespace {

// 50 us to 100 ms: a tick at 240 Hz has 4 ms, one at 10 Hz has 100.
const prometheus::Histogram::BucketBoundaries kBuckets = {50e-6, 100e-6, 200e-6, 400e-6, 800e-6, 1.6e-3, 3e-3,
                                                          5e-3,  8e-3,   12e-3,  16e-3,  25e-3,  50e-3,  100e-3};

prometheus::Counter& Counter(prometheus::Registry& registry, const char* name, const char* help,
                             const prometheus::Labels& labels = {}) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add(labels);
}

prometheus::Gauge& Gauge(prometheus::Registry& registry, const char* name, const char* help,
                         const prometheus::Labels& labels = {}) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add(labels);
}

prometheus::Histogram& Histogram(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry).Add({}, kBuckets);
}

// A family that has several members is registered again for each with the same help; the registry merges them.
constexpr char kBodies[] = "tessera_region_bodies", kBodiesHelp[] = "Bodies by state; the sleeping ones are owned.";
constexpr char kHandovers[] = "tessera_region_handovers_total", kHandoversHelp[] = "Bodies handed over.";
constexpr char kFrameBytes[] = "tessera_region_frame_bytes_total";
constexpr char kFrameBytesHelp[] = "Bytes of frames to and from neighbours.";
constexpr char kLinksRefused[] = "tessera_region_links_refused_total",
               kLinksRefusedHelp[] = "Hellos of regions that were refused.";
constexpr char kCommands[] = "tessera_region_commands_total",
               kCommandsHelp[] = "Commands of clients by what came of them.";
constexpr char kInputs[] = "tessera_region_inputs_total", kInputsHelp[] = "Inputs of clients by what came of them.";

}  // namespace

AcceptorMetrics::AcceptorMetrics(prometheus::Registry& registry, const char* port)
    : cut_short_(
          Counter(registry, "tessera_region_receive_cut_short_total",
                  "Times that a port left datagrams waiting, because it had looked at as many as it may at once.",
                  {{"port", port}})),
      kernel_dropped_(
          Counter(registry, "tessera_region_kernel_dropped_total",
                  "Datagrams that the kernel dropped before a port saw them: for want of room, or in a flood.",
                  {{"port", port}})),
      floods_(Counter(registry, "tessera_region_floods_total",
                      "Sessions that were ended because they sent too much for too long.", {{"port", port}})) {
  using Stats = net::AcceptorStats;
  const auto datagrams = [&](const char* result, std::uint64_t Stats::*count) {
    series_.push_back(
        {&Counter(registry, "tessera_region_acceptor_datagrams_total",
                  "What came of datagrams at a port's acceptor; sealed ones that were taken are not counted.",
                  {{"port", port}, {"result", result}}),
         count});
  };
  datagrams("hello", &Stats::hellos);
  datagrams("accepted", &Stats::accepted);
  datagrams("refused", &Stats::refused);
  datagrams("limited", &Stats::limited);
  datagrams("hello_limited", &Stats::hellos_limited);
  datagrams("held_off", &Stats::held_off);
  datagrams("excess", &Stats::excess);
  datagrams("stale", &Stats::stale);
  datagrams("unknown", &Stats::unknown);
  datagrams("replayed", &Stats::replayed);
  datagrams("forged", &Stats::forged);
  series_.push_back({&floods_, &Stats::floods});
  const auto bytes = [&](const char* direction, std::uint64_t Stats::*count) {
    series_.push_back({&Counter(registry, "tessera_region_acceptor_bytes_total",
                                "Bytes from and to peers that have not proven who they are.",
                                {{"port", port}, {"direction", direction}}),
                       count});
  };
  bytes("in", &Stats::bytes_from_unproven);
  bytes("out", &Stats::bytes_to_unproven);
}

void AcceptorMetrics::Take(const net::AcceptorStats& now, const net::ReceiveStats& received) {
  for (const Series& series : series_) {
    const std::uint64_t more = now.*series.count - before_.*series.count;
    if (more > 0) series.counter->Increment(static_cast<double>(more));
  }
  before_ = now;
  cut_short_.Increment(static_cast<double>(received.cut_short - received_before_.cut_short));
  kernel_dropped_.Increment(static_cast<double>(received.kernel_dropped - received_before_.kernel_dropped));
  received_before_ = received;
}

WorkerMetrics::WorkerMetrics()
    : registry_(std::make_shared<prometheus::Registry>(prometheus::Registry::InsertBehavior::Merge)),
      tick(Gauge(*registry_, "tessera_region_tick", "The last tick simulated.")),
      map_version(Gauge(*registry_, "tessera_region_map_version", "The map by which it was simulated.")),
      ticks(Counter(*registry_, "tessera_region_ticks_total", "Ticks simulated.")),
      late_ticks(Counter(*registry_, "tessera_region_late_ticks_total",
                         "Ticks that ended more than one tick after they were due.")),
      step(Histogram(*registry_, "tessera_region_step_seconds", "Work of a whole tick, without waiting.")),
      physics(Histogram(*registry_, "tessera_region_physics_seconds", "The physics update of a tick.")),
      prediction(Histogram(*registry_, "tessera_region_prediction_seconds", "The prediction of a tick.")),
      snapshot_full(Histogram(*registry_, "tessera_region_snapshot_full_seconds",
                              "A broadcast in which some client got bodies without a baseline.")),
      snapshot_delta(Histogram(*registry_, "tessera_region_snapshot_delta_seconds", "A broadcast of deltas alone.")),
      frame_wait(Histogram(*registry_, "tessera_region_frame_wait_seconds", "Waiting for the neighbours' frames.")),
      owned(Gauge(*registry_, kBodies, kBodiesHelp, {{"state", "owned"}})),
      ghosts(Gauge(*registry_, kBodies, kBodiesHelp, {{"state", "ghost"}})),
      asleep(Gauge(*registry_, kBodies, kBodiesHelp, {{"state", "asleep"}})),
      handovers_in(Counter(*registry_, kHandovers, kHandoversHelp, {{"direction", "in"}})),
      handovers_out(Counter(*registry_, kHandovers, kHandoversHelp, {{"direction", "out"}})),
      frame_bytes_in(Counter(*registry_, kFrameBytes, kFrameBytesHelp, {{"direction", "in"}})),
      frame_bytes_out(Counter(*registry_, kFrameBytes, kFrameBytesHelp, {{"direction", "out"}})),
      snapshot_bytes(Counter(*registry_, "tessera_region_snapshot_bytes_total", "Bytes of snapshots sent to clients.")),
      scene_bytes(Counter(*registry_, "tessera_region_scene_bytes_total",
                          "Bytes of packed scenes and of tiles sent to clients.")),
      clients(Gauge(*registry_, "tessera_region_clients", "Clients connected.")),
      inputs_applied(Counter(*registry_, kInputs, kInputsHelp, {{"result", "applied"}})),
      inputs_refused(Counter(*registry_, kInputs, kInputsHelp, {{"result", "refused"}})),
      inputs_late(Counter(*registry_, kInputs, kInputsHelp, {{"result", "late"}})),
      inputs_not_owner(Counter(*registry_, kInputs, kInputsHelp, {{"result", "not_owner"}})),
      commands_taken(Counter(*registry_, kCommands, kCommandsHelp, {{"result", "taken"}})),
      commands_refused(Counter(*registry_, kCommands, kCommandsHelp, {{"result", "refused"}})),
      commands_limited(Counter(*registry_, kCommands, kCommandsHelp, {{"result", "limited"}})),
      game_events(
          Counter(*registry_, "tessera_region_game_events_total", "Events of the game that were sent to clients.")),
      links_of_other_rules(Counter(*registry_, kLinksRefused, kLinksRefusedHelp, {{"reason", "rules"}})),
      links_refused(Counter(*registry_, kLinksRefused, kLinksRefusedHelp, {{"reason", "unknown"}})),
      nonfinite_bodies(Counter(*registry_, "tessera_region_nonfinite_bodies_total",
                               "Bodies taken out because their state was not a number.")),
      unprotected(Gauge(*registry_, "tessera_region_unprotected", "1 while the standby does not have a whole tick.")),
      paused(Gauge(*registry_, "tessera_region_paused", "1 while there is no lease to step.")),
      failover_gap(
          Gauge(*registry_, "tessera_region_failover_gap_seconds", "Time without a step that the last failover cost.")),
      promotion_age(Gauge(*registry_, "tessera_region_promotion_age_ticks",
                          "How far behind the newest tick the state was that the last failover promoted here.")),
      longest_tick(Gauge(*registry_, "tessera_region_longest_tick_seconds",
                         "The longest time from one step to the next, of the last 10 s.")),
      longest_tick_cpu(
          Gauge(*registry_, "tessera_region_longest_tick_cpu_seconds",
                "The most CPU time of the thread that steps, from one step to the next, of the last 10 s.")),
      standby_bytes(Counter(*registry_, "tessera_region_standby_bytes_total", "Bytes of log sent to the standby.")),
      standby_gaps(Counter(*registry_, "tessera_region_standby_gaps_total",
                           "Messages of a primary's log that could not be used: a whole state was asked for.")),
      failovers(Counter(*registry_, "tessera_region_failovers_total", "Failovers that this region went through.")),
      links_down(Counter(*registry_, "tessera_region_links_down_total",
                         "Times that a neighbour was silent for so long that the link was down.")),
      game_calls(Counter(*registry_, "tessera_game_calls_total", "Calls of the game's callbacks.")),
      game_errors(Counter(*registry_, "tessera_game_errors_total", "Calls of the game that failed.")),
      game_instructions(Counter(*registry_, "tessera_game_instructions_total", "Instructions that the game ran.")),
      game_dropped_events(Counter(*registry_, "tessera_game_dropped_events_total",
                                  "Events that the game never saw, because too many waited.")),
      game_dropped_lines(Counter(*registry_, "tessera_game_dropped_lines_total",
                                 "Lines of the game that were left out of the log, because there were too many.")),
      game_dropped_counts(
          Counter(*registry_, "tessera_game_dropped_counts_total",
                  "Calls of world.count that came to nothing, because the game has too many counters.")),
      game_published(Counter(*registry_, "tessera_game_published_total",
                             "Events for the game's backend that came to the world's record here.")),
      game_unpublished(Counter(*registry_, "tessera_game_unpublished_total",
                               "Events for the game's backend that were left out, because too many waited.")),
      game_publishing(Gauge(*registry_, "tessera_game_published_waiting",
                            "Events for the game's backend that the control plane has not stored yet.")),
      game_callbacks_off(Gauge(*registry_, "tessera_game_callbacks_off",
                               "Callbacks of the game that failed too often in a row and are not called any more.")),
      world_paused(Gauge(*registry_, "tessera_region_world_paused", "1 while the world is paused, by its operator.")),
      world_pace(Gauge(*registry_, "tessera_region_world_ticks_per_second",
                       "Ticks a second that the world is to make; 0 while it is paused.")),
      messages_sent(Counter(*registry_, "tessera_game_messages_sent_total", "Messages that the game sent.")),
      messages_applied(
          Counter(*registry_, "tessera_game_messages_applied_total", "Messages that came to their targets here.")),
      messages_late(Counter(*registry_, "tessera_game_messages_late_total",
                            "Messages that were applied after the tick that they were due in.")),
      messages_repeated(Counter(*registry_, "tessera_game_messages_repeated_total",
                                "Messages that were sent again, because no acknowledgement had come.")),
      messages_copies(
          Counter(*registry_, "tessera_game_messages_copies_total", "Messages that came and were here already.")),
      messages_refused(Counter(*registry_, "tessera_game_messages_refused_total",
                               "Messages that were dropped because their target is gone.")),
      messages_failed(Counter(*registry_, "tessera_game_messages_failed_total",
                              "Functions of bodies that failed when they were carried out for another region.")),
      messages_unheard(Counter(*registry_, "tessera_game_messages_unheard_total",
                               "Messages that came to a target without on_message.")),
      message_ticks(Counter(*registry_, "tessera_game_messages_ticks_total",
                            "Ticks from when messages were made until they were applied, in all.")),
      message_ticks_max(Gauge(*registry_, "tessera_game_messages_ticks_max",
                              "The most ticks from when a message was made until it was applied.")),
      game_acceptor(*registry_, "game"),
      link_acceptor(*registry_, "links") {
  for (std::size_t i = 0; i < kDropReasonNames.size(); ++i) {
    frames_dropped[i] = &Counter(*registry_, "tessera_region_frames_dropped_total", "Frames that were not used.",
                                 {{"reason", std::string(kDropReasonNames[i])}});
  }
  for (std::size_t i = 0; i < game_effects.size(); ++i) {
    const auto effect = [&](const char* result) {
      return &Counter(*registry_, "tessera_game_effects_total", "What callbacks of the game asked for.",
                      {{"effect", std::string(game::kEffectNames[i])}, {"result", result}});
    };
    game_effects[i] = {effect("done"), effect("discarded"), effect("refused")};
  }
  for (std::size_t i = 0; i < messages_by_hops.size(); ++i) {
    messages_by_hops[i] =
        &Counter(*registry_, "tessera_game_messages_by_hops_total",
                 "Messages that were applied, by the borders between both ends.", {{"hops", std::to_string(i)}});
  }
}

void WorkerMetrics::ShowEffects(const game::EffectCounts& effects) {
  for (std::size_t i = 0; i < effects.size(); ++i) {
    Follow(*game_effects[i].done, effects[i].done);
    Follow(*game_effects[i].discarded, effects[i].discarded);
    Follow(*game_effects[i].refused, effects[i].refused);
  }
}

WorkerMetrics::NeighbourSeries& WorkerMetrics::SeriesOf(RegionId neighbour) {
  const auto [found, first] = neighbours_.try_emplace(neighbour);
  NeighbourSeries& series = found->second;
  if (!first) return series;
  const prometheus::Labels labels{{"neighbour", std::to_string(neighbour.value())}};
  series.wait = &Counter(*registry_, "tessera_region_neighbour_wait_seconds_total",
                         "Waiting for the neighbour whose frame came last.", labels);
  series.round_trip = &Gauge(*registry_, "tessera_region_link_round_trip_seconds",
                             "To the neighbour and back; 0 without a link.", labels);
  series.parts = &Counter(*registry_, "tessera_region_link_parts_total",
                          "Parts of messages that were sent to the neighbour.", labels);
  series.resent = &Counter(*registry_, "tessera_region_link_parts_resent_total",
                           "Those of them that were sent again, because no answer had come in time.", labels);
  return series;
}

void WorkerMetrics::CountWait(std::span<const RegionId> neighbours, double seconds) {
  for (const RegionId neighbour : neighbours) SeriesOf(neighbour).wait->Increment(seconds);
}

void WorkerMetrics::ShowRoundTrip(RegionId neighbour, double seconds) { SeriesOf(neighbour).round_trip->Set(seconds); }

void WorkerMetrics::CountParts(RegionId neighbour, const LinkParts::Counts& parts) {
  NeighbourSeries& series = SeriesOf(neighbour);
  series.parts->Increment(parts.sent);
  series.resent->Increment(parts.resent);
}

void WorkerMetrics::ShowMessages(const game::MessageStatistics& messages, const region::RelayStatistics& relayed) {
  Follow(messages_sent, messages.sent);
  Follow(messages_applied, messages.applied);
  Follow(messages_late, messages.late);
  Follow(messages_failed, messages.failed);
  Follow(messages_unheard, messages.unheard);
  Follow(message_ticks, messages.ticks);
  message_ticks_max.Set(static_cast<double>(messages.most_ticks));
  Follow(messages_repeated, relayed.repeated);
  Follow(messages_copies, relayed.copies);
  Follow(messages_refused, relayed.refused);
  for (std::size_t i = 0; i < messages_by_hops.size(); ++i) Follow(*messages_by_hops[i], messages.by_hops[i]);
}

void WorkerMetrics::Follow(prometheus::Counter& counter, std::uint64_t total) {
  const std::uint64_t before = std::exchange(totals_[&counter], total);
  const std::uint64_t more = total < before ? total : total - before;  // a region that is built anew counts anew
  if (more > 0) counter.Increment(static_cast<double>(more));
}

void WorkerMetrics::FollowNamed(const char* family, const char* help, const char* label, const std::string& name,
                                std::uint64_t total) {
  prometheus::Counter*& counter = named_[{family, name}];
  if (counter == nullptr) counter = &Counter(*registry_, family, help, {{label, name}});
  Follow(*counter, total);
}

void WorkerMetrics::ShowGame(const game::GameHost& game) {
  for (const auto& [name, count] : game.counters()) {
    FollowNamed("tessera_game_counter_total", "What the game counts.", "name", name, count);
  }
  for (const auto& [name, cost] : game.costs()) {
    FollowNamed("tessera_game_callback_calls_total", "Calls of a callback.", "callback", name, cost.calls);
    FollowNamed("tessera_game_callback_errors_total", "Calls of a callback that failed.", "callback", name,
                cost.errors);
    FollowNamed("tessera_game_callback_instructions_total", "Instructions that a callback ran.", "callback", name,
                cost.instructions);
  }
}

void WorkerMetrics::Show(const RegionRun& run, const LinkTable& links) {
  const region::Region& region = run.region();
  const TickCounts& counts = run.statistics().counts();
  tick.Set(static_cast<double>(region.tick().value()));
  map_version.Set(static_cast<double>(region.map().version().value()));
  owned.Set(static_cast<double>(region.owned().size()));
  ghosts.Set(static_cast<double>(region.ghost_count()));
  asleep.Set(static_cast<double>(region.asleep_count()));
  unprotected.Set(run.standby_log().unprotected() ? 1 : 0);
  paused.Set(run.paused() ? 1 : 0);
  const ClockState& clock = run.clock().state();
  world_paused.Set(clock.paused ? 1 : 0);
  world_pace.Set(clock.paused ? 0 : clock.ticks_per_second);
  failover_gap.Set(static_cast<double>(run.failover_figures().last_gap_ms) * 1e-3);
  promotion_age.Set(static_cast<double>(run.failover_figures().promotion_age_ticks));
  Follow(ticks, counts.ticks);
  Follow(late_ticks, counts.late_ticks);
  Follow(handovers_in, counts.handovers_in);
  Follow(handovers_out, counts.handovers_out);
  Follow(nonfinite_bodies, counts.nonfinite_bodies);
  Follow(frame_bytes_out, links.frame_bytes());
  Follow(standby_bytes, run.standby_log().bytes_sent());
  Follow(standby_gaps, run.copies().gaps());
  Follow(failovers, run.failover_figures().failovers);
  Follow(links_down, run.ticks().links_down());
  if (const game::GameHost* game = run.game()) {
    const game::GameStatistics& played = game->statistics();
    Follow(game_calls, played.calls);
    Follow(game_errors, played.errors);
    Follow(game_instructions, played.instructions);
    Follow(game_dropped_events, played.dropped_events);
    Follow(game_dropped_lines, played.dropped_lines + run.game_log().left_out());
    Follow(game_dropped_counts, played.dropped_counts);
    Follow(game_published, played.published);
    Follow(game_unpublished, played.unpublished);
    game_publishing.Set(static_cast<double>(region.published().size()));
    game_callbacks_off.Set(played.callbacks_off);
    ShowEffects(played.effects);
    ShowMessages(played.messages, region.messages());
  }
  for (std::size_t i = 0; i < frames_dropped.size(); ++i) Follow(*frames_dropped[i], run.drops()[i]);
}

}  // namespace tessera::worker
