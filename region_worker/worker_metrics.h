// WorkerMetrics: the series that a worker shows Prometheus. docs/metrics.md lists the names and meanings.
//
// Every series exists from the start, those of a neighbour or a callback from its first figure on. Counting costs an
// atomic add, a histogram an uncontended lock; the loop does so a few times a tick, never per body. Only the first
// figure of a series takes the registry's lock, which a scrape holds for as long as it lasts, on a thread that goes
// after the loop. Thread rule: the loop writes, the HTTP server reads; the objects lock themselves.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/game/game_host.h"
#include "core/region/message_relay.h"
#include "net/acceptor.h"
#include "net/endpoint.h"
#include "prometheus/counter.h"
#include "prometheus/gauge.h"
#include "prometheus/histogram.h"
#include "prometheus/registry.h"
#include "region_worker/core/drop_reason.h"
#include "region_worker/core/region_run.h"
#include "region_worker/link_parts.h"

namespace tessera::worker {

// Counters of the datagrams that the acceptor of one port saw, by result, and of those that it never saw.
class AcceptorMetrics {
 public:
  AcceptorMetrics(prometheus::Registry& registry, const char* port);
  // `now` counts from the start of the port.
  void Take(const net::AcceptorStats& now, const net::ReceiveStats& received);
  // One more session was ended for what it sent, which the acceptor does not know of.
  void CountFlood() { floods_.Increment(); }

 private:
  struct Series {
    prometheus::Counter* counter;
    std::uint64_t net::AcceptorStats::*count;
  };
  std::vector<Series> series_;
  net::AcceptorStats before_;
  prometheus::Counter &cut_short_, &kernel_dropped_, &floods_;
  net::ReceiveStats received_before_;
};

class WorkerMetrics {
 public:
  WorkerMetrics();

  std::shared_ptr<prometheus::Registry> registry() const { return registry_; }

 private:
  std::shared_ptr<prometheus::Registry> registry_;

 public:
  prometheus::Gauge &tick, &map_version;
  prometheus::Counter &ticks, &late_ticks;
  prometheus::Histogram &step, &physics, &prediction, &snapshot_full, &snapshot_delta, &frame_wait;
  prometheus::Gauge &owned, &ghosts, &asleep;
  prometheus::Counter &handovers_in, &handovers_out;
  prometheus::Counter &frame_bytes_in, &frame_bytes_out;
  prometheus::Counter& snapshot_bytes;
  prometheus::Counter& scene_bytes;
  prometheus::Gauge& clients;
  prometheus::Counter &inputs_applied, &inputs_refused, &inputs_late, &inputs_not_owner;
  prometheus::Counter &commands_taken, &commands_refused, &commands_limited, &game_events;
  prometheus::Counter &links_of_other_rules, &links_refused;
  std::array<prometheus::Counter*, kDropReasonNames.size()> frames_dropped{};
  prometheus::Counter& nonfinite_bodies;
  prometheus::Gauge &unprotected, &paused, &failover_gap, &promotion_age, &longest_tick, &longest_tick_cpu;
  prometheus::Counter &standby_bytes, &standby_gaps, &failovers, &links_down;
  prometheus::Counter &game_calls, &game_errors, &game_instructions, &game_dropped_events, &game_dropped_lines;
  prometheus::Counter &game_dropped_counts, &game_published, &game_unpublished;
  struct EffectSeries {
    prometheus::Counter *done = nullptr, *discarded = nullptr, *refused = nullptr;
  };
  std::array<EffectSeries, game::kEffects> game_effects{};
  prometheus::Gauge& game_publishing;
  prometheus::Gauge& game_callbacks_off;
  prometheus::Gauge &world_paused, &world_pace;
  prometheus::Counter &messages_sent, &messages_applied, &messages_late, &messages_repeated, &messages_copies,
      &messages_refused, &messages_failed, &messages_unheard, &message_ticks;
  prometheus::Gauge& message_ticks_max;
  std::array<prometheus::Counter*, game::MessageStatistics::kHops> messages_by_hops{};
  AcceptorMetrics game_acceptor, link_acceptor;

  void CountDropped(DropReason reason) { frames_dropped[static_cast<std::size_t>(reason)]->Increment(); }
  // A step waited so long for the frames of `neighbours`, which came last, together.
  void CountWait(std::span<const RegionId> neighbours, double seconds);
  void ShowRoundTrip(RegionId neighbour, double seconds);
  void CountParts(RegionId neighbour, const LinkParts::Counts& parts);
  // Brings the series of a region's state up to date.
  void Show(const RegionRun& run, const LinkTable& links);
  // The same for the game's own counters and what each callback cost: not in every tick.
  void ShowGame(const game::GameHost& game);

 private:
  void ShowEffects(const game::EffectCounts& effects);
  void ShowMessages(const game::MessageStatistics& messages, const region::RelayStatistics& relayed);
  // Adds what `total`, a sum that is kept elsewhere, has grown by.
  void Follow(prometheus::Counter& counter, std::uint64_t total);

  void FollowNamed(const char* family, const char* help, const char* label, const std::string& name,
                   std::uint64_t total);

  struct NeighbourSeries {
    prometheus::Counter *wait = nullptr, *parts = nullptr, *resent = nullptr;
    prometheus::Gauge* round_trip = nullptr;
  };
  NeighbourSeries& SeriesOf(RegionId neighbour);

  std::map<const prometheus::Counter*, std::uint64_t> totals_;
  std::map<RegionId, NeighbourSeries> neighbours_;
  std::map<std::pair<std::string, std::string>, prometheus::Counter*> named_;  // by family and name
};

}  // namespace tessera::worker
