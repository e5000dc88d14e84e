// SnapshotBroadcast: sends the clients of a region snapshots of what it owns, snapshot_rate_hz times a second.
//
// It keeps one history for all clients and one sender for each. Nothing is quantised or encoded while there is no
// client, or for a body that has not changed. Departures are gathered until the next snapshot. Regions take turns: the
// ticks of snapshots depend on the region, so that the regions of one machine do not have their longest ticks together.
//
//   for (const auto& ack : port.Service(now, tick, started).acknowledgements) broadcast.Acknowledge(ack.from,
//   ack.bytes); broadcast.AfterTick(region, departures, places, port);
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/region/region.h"
#include "core/replication/snapshot.h"
#include "net/endpoint.h"
#include "region_worker/body_feed.h"
#include "region_worker/core/player_places.h"
#include "region_worker/game_port.h"
#include "region_worker/worker_metrics.h"

namespace tessera::worker {

// Whether this region sends a snapshot after this tick: as often as the rates say, in any ratio.
bool SnapshotFallsOn(Tick tick, RegionId region, std::uint32_t snapshot_rate_hz, std::uint32_t tick_rate_hz);

class SnapshotBroadcast {
 public:
  SnapshotBroadcast(RegionId self, const Scene& scene, std::uint32_t snapshot_rate_hz,
                    const replication::SnapshotSettings& settings, WorkerMetrics& metrics);

  // A client's acknowledgement; one that is malformed or comes from a client that has left is ignored.
  void Acknowledge(net::PeerHandle from, std::span<const std::uint8_t> bytes);
  // To be called after each tick; sends if a snapshot falls on it. `places` holds the places of players whose bodies
  // other regions own; null where there is only this region.
  void AfterTick(const region::Region& region, std::span<const region::Departure> departures,
                 const PlayerPlaces* places, GamePort& port);
  // For a region that does not step: sends all clients a snapshot of its tick, if none fell on it, and clients that are
  // new what there is, once and as far as one snapshot holds it.
  void ShowStanding(const region::Region& region, const PlayerPlaces* places, GamePort& port);

 private:
  // A client that a snapshot is written for.
  struct Recipient {
    net::PeerHandle peer;
    const ConnectedClient* client;
    replication::SnapshotSender* sender;
  };

  static std::uint64_t SendMovement(const region::Region& region, net::PeerHandle peer, const ConnectedClient& client,
                                    GamePort& port);
  void Push(const region::Region& region);
  // Makes senders for clients that are new and drops those of clients that have left, or wait for the scene.
  std::vector<Recipient> Recipients(const GamePort& port);
  replication::ClientView ViewOf(const region::Region& region, const PlayerPlaces* places,
                                 const ConnectedClient& client) const;

  RegionId self_;
  const Scene& scene_;
  replication::SnapshotSettings settings_;
  std::uint32_t tick_rate_hz_, snapshot_rate_hz_;
  WorkerMetrics& metrics_;
  std::optional<replication::SnapshotHistory> history_;  // while there are clients
  std::map<net::PeerHandle, replication::SnapshotSender> senders_;
  BodyFeed feed_;
  Tick pushed_;  // the newest in the history
};

}  // namespace tessera::worker
