// TickLoop: the region's ticks against the clock: steps when a tick is due and the neighbours' frames are here, sends
// what comes of it, and counts.
//
//   TickLoop ticks(config, snapshot_rate_hz, links, game, metrics);   // sends the frames of tick 0
//   ticks.Run(now);
//   while (...) { receive; if (!ticks.Advance()) wait until ticks.wake_at(now), or until something comes; }
//
// Thread rule: one thread.
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "core/region/census.h"
#include "core/region/region.h"
#include "region_worker/game_port.h"
#include "region_worker/order.h"
#include "region_worker/region_links.h"
#include "region_worker/snapshot_broadcast.h"
#include "region_worker/step_times.h"
#include "region_worker/tick_pacer.h"

namespace tessera::worker {

// Since the start.
struct TickCounts {
  std::uint64_t late_ticks = 0, nonfinite_bodies = 0;
  std::uint64_t handovers_in = 0, handovers_out = 0;
  std::uint64_t spawned_bodies = 0, removed_bodies = 0;
};

class TickLoop {
 public:
  static constexpr std::size_t kCensusesKept = 5;

  TickLoop(region::Config config, std::uint32_t snapshot_rate_hz, const replication::Settings& replication,
           RegionLinks& links, GamePort& game, WorkerMetrics& metrics);

  // Whole state: players that are new are spawned, those that left are removed.
  void SetPlayers(std::span<const OrderedPlayer> players);
  void OnFrame(RegionId from, std::span<const std::uint8_t> bytes, TimePoint now);
  void OnInput(const ClientInput& input, TimePoint now);
  // Time that the caller spent on what came for this region since the last tick: part of the whole tick.
  void AddReceiveTime(Duration spent) { receive_time_ += spent; }

  void Run(TimePoint now);
  bool running() const { return running_; }
  // Steps if a tick is due and can be stepped. Call again until it returns false.
  bool Advance();
  // When a tick will be due; nullopt while only a neighbour's frame can change anything, or before Run.
  std::optional<TimePoint> wake_at(TimePoint now) const;

  const region::Region& region() const { return region_; }
  const TickCounts& counts() const { return counts_; }
  TimeSummary step_times() const { return step_times_.Summary(); }
  double rate_hz(TimePoint now) const { return rate_.rate_hz(now); }
  const std::deque<region::Census>& censuses() const { return censuses_; }  // oldest first

 private:
  void StepOnce(TimePoint begin);
  region::StepResult TimedStep();
  void Count(const region::StepResult& result);
  void CountSpawned();
  void KeepCensus();
  void RemoveLeft();
  void ShowBodies();

  region::Region region_;
  RegionLinks& links_;
  GamePort& game_;
  WorkerMetrics& metrics_;
  std::uint32_t tick_rate_hz_;
  bool scene_has_players_;
  TickPacer pacer_;
  SnapshotBroadcast broadcast_;
  StepTimes step_times_;
  RateMeter rate_;
  TickCounts counts_;
  std::deque<region::Census> censuses_;
  bool running_ = false;
  Duration receive_time_{0};
  std::optional<TimePoint> waiting_since_;  // for frames
  TimePoint may_log_drop_at_{};
  std::uint64_t drops_unlogged_ = 0;
  std::set<PlayerNumber> asked_to_spawn_, left_;
  std::vector<PlayerNumber> spawning_;  // asked for, not seen yet
};

}  // namespace tessera::worker
