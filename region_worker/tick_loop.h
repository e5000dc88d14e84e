// TickLoop: the region's ticks against the clock: steps when a tick is due, the neighbours' frames are here and the
// lease holds, sends what comes of it, and counts. A neighbour that has said nothing for kSilence is waited for no
// more: its border closes.
//
//   TickLoop ticks(config, snapshot_rate_hz, links, game, metrics);   // sends the frames of tick 0
//   ticks.Run(now);
//   while (...) { receive; if (!ticks.Advance()) wait until ticks.wake_at(now), or until something comes; }
//
// Thread rule: one thread.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "core/region/census.h"
#include "core/region/region.h"
#include "region_worker/game_port.h"
#include "region_worker/heir_log.h"
#include "region_worker/lease.h"
#include "region_worker/order.h"
#include "region_worker/player_places.h"
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
  std::uint64_t last_gap_ms = 0;  // the longest time without a step that the last failover cost
};

class TickLoop {
 public:
  static constexpr std::size_t kCensusesKept = 5, kTakenOutKept = 100;
  // After this a neighbour is silent. One that waits itself says so every kCareDistance; but regions may wait for each
  // other in a circle: after kStuck nobody is waited for any more.
  static constexpr Duration kSilence = std::chrono::milliseconds(250);
  static constexpr Duration kStuck = std::chrono::seconds(1);
  static constexpr Duration kCareDistance = std::chrono::milliseconds(50);

  TickLoop(region::Config config, std::uint32_t snapshot_rate_hz, const replication::Settings& replication,
           RegionLinks& links, GamePort& game, WorkerMetrics& metrics);

  // Whole state: players that are new are spawned, those that left are removed, the parked stand still. `joins`: this
  // worker is only about to join the world; who is said to be made by its region was made by an earlier life of it.
  void SetPlayers(std::span<const OrderedPlayer> players, bool joins);
  // Changes of properties that all regions are told to make; made before each step.
  void SetPropertyOrders(std::vector<PropertyOrder> orders) { property_orders_.Set(std::move(orders)); }
  std::vector<PropertyAnswer> PropertyAnswers() const {
    return property_orders_.Answers(region_, heir_log_.heir() != RegionId());
  }
  void OnFrame(RegionId from, std::span<const std::uint8_t> bytes, TimePoint now);
  void OnPlaces(RegionId from, std::span<const std::uint8_t> bytes, TimePoint now);
  void OnInput(const ClientInput& input, TimePoint now);
  // Time that the caller spent on what came for this region since the last tick: part of the whole tick.
  void AddReceiveTime(Duration spent) { receive_time_ += spent; }

  void Run(TimePoint now);
  bool running() const { return running_; }
  // No lease: nothing is stepped, and nobody told.
  bool paused() const { return paused_; }
  bool stepped() const { return stepped_; }  // at least once
  // Steps if a tick is due and can be stepped. Call again until it returns false.
  bool Advance();
  // A state that is so old is to be taken up.
  void NoteTakeover(std::uint64_t age_ticks) { metrics_.takeover_age.Set(static_cast<double>(age_ticks)); }
  // The region has a map and its part of the dead: goes on.
  absl::Status Resume(const region::Resolution& resolution, std::span<const region::Standby* const> wards);
  // When a tick will be due; nullopt while only a neighbour's frame can change anything, or before Run.
  std::optional<TimePoint> wake_at(TimePoint now) const;

  const region::Region& region() const { return region_; }
  region::Region& region() { return region_; }
  HeirLog& heir_log() { return heir_log_; }
  const HeirLog& heir_log() const { return heir_log_; }
  Lease& lease() { return lease_; }
  const TickCounts& counts() const { return counts_; }
  TimeSummary step_times() const { return step_times_.Summary(); }
  double rate_hz(TimePoint now) const { return rate_.rate_hz(now); }
  const std::deque<region::Census>& censuses() const { return censuses_; }  // oldest first
  const std::deque<BodyId>& taken_out() const { return taken_out_; }        // non-finite; the newest, oldest first

 private:
  bool MayStep(TimePoint now);
  void StepOnce(TimePoint begin);
  void Publish(region::StepResult result, TimePoint now);
  void TellPlaces();
  void NoteDropped(std::string_view what, RegionId from, const absl::Status& status, TimePoint now);
  void CareForNeighbors(TimePoint now);
  void CloseSilent(TimePoint now, bool stood_still);
  void NoteTickLength(TimePoint now);
  bool IsInMap() const;
  region::StepResult TimedStep();
  void Count(const region::StepResult& result);
  void CountSpawned();
  void KeepCensus();
  bool HasLeft(PlayerNumber player) const;
  void RemoveLeft();
  void ShowBodies();

  region::Region region_;
  RegionLinks& links_;
  GamePort& game_;
  WorkerMetrics& metrics_;
  Lease lease_;
  HeirLog heir_log_;
  std::uint32_t tick_rate_hz_;
  bool scene_has_players_;
  TickPacer pacer_;
  std::optional<PlayerPlaces> places_;  // where views have a radius
  SnapshotBroadcast broadcast_;
  StepTimes step_times_;
  RateMeter rate_;
  TickCounts counts_;
  std::deque<region::Census> censuses_;
  std::deque<BodyId> taken_out_;
  bool running_ = false, paused_ = false;
  bool stepped_ = false;
  bool resumed_ = false;   // no step since
  bool left_out_ = false;  // the map in force has no place for it: it waits for its end
  TimePoint stepped_at_{}, care_at_{};
  std::map<RegionId, TimePoint> missing_since_;  // neighbours that are waited for
  LongestTick longest_tick_;
  TickLength since_step_;     // until the next one
  Duration worked_until_{0};  // CPU time of this thread when the last step began
  TimePoint may_log_long_at_{};
  Duration receive_time_{0};
  std::optional<TimePoint> waiting_since_;  // for frames
  TimePoint may_log_drop_at_{};
  std::uint64_t drops_unlogged_ = 0;
  std::set<PlayerNumber> asked_to_spawn_, left_, named_;  // of those that the newest order names
  PlayerNumber newest_named_;                             // by any order
  PropertyOrders property_orders_;
  std::vector<PlayerNumber> spawning_;  // asked for, not seen yet
};

}  // namespace tessera::worker
