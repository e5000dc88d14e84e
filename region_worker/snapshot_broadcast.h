// SnapshotBroadcast: shows the clients of a region what it owns, snapshot_rate_hz times a second.
//
// Nothing is quantised or encoded while there is no client, nor of a body that is as it was. What bodies ceased to be
// owned since the last snapshot is gathered for the next. Regions take turns: on which ticks snapshots fall depends on
// the region, so that those of one machine are not all at their longest ticks at one time.
// Thread rule: one thread.
#pragma once

#include <optional>
#include <span>

#include "core/region/region.h"
#include "core/replication/snapshot.h"
#include "region_worker/body_feed.h"
#include "region_worker/core/player_places.h"
#include "region_worker/game_port.h"
#include "region_worker/worker_metrics.h"

namespace tessera::worker {

// Whether this region shows a snapshot after this tick: as often as the rates say, in any ratio.
bool SnapshotFallsOn(Tick tick, RegionId region, std::uint32_t snapshot_rate_hz, std::uint32_t tick_rate_hz);

class SnapshotBroadcast {
 public:
  SnapshotBroadcast(RegionId self, const Scene& scene, std::uint32_t snapshot_rate_hz,
                    const replication::Settings& settings, WorkerMetrics& metrics);

  // After each tick; sends if a snapshot falls on it. `places`: of players whose bodies others own; null: not asked
  // for.
  void AfterTick(const region::Region& region, std::span<const region::Departure> departures,
                 const PlayerPlaces* places, GamePort& port);

 private:
  replication::ClientView ViewOf(const region::Region& region, const PlayerPlaces* places, const Client& client) const;

  RegionId self_;
  const Scene& scene_;
  replication::Settings settings_;
  std::uint32_t tick_rate_hz_, snapshot_rate_hz_;
  WorkerMetrics& metrics_;
  std::optional<replication::SnapshotHistory> history_;  // while there are clients
  BodyFeed feed_;
};

}  // namespace tessera::worker
