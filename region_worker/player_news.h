// PlayerNewsFeed: sends the client of each player whose body a region owns what the game has for it: which commands are
// taken for good, events, which body it moves, where a spectator looks from, and that the game has ended its session.
//
// A connection is sent what is new to it, by ENet, in order; all that waits when the body comes to be owned here, since
// what the last owner sent may be lost with its connection. The client passes over what it has.
//
//   feed.AfterTick(region, port);   // after each tick
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/region/region.h"
#include "core/world/math.h"
#include "core/world/player_limits.h"
#include "net/endpoint.h"
#include "region_worker/game_port.h"
#include "region_worker/worker_metrics.h"
#include "tessera/v1/game.pb.h"

namespace tessera::worker {

// It remembers what a connection of a client was sent.
struct SentNews {
  std::uint32_t last_command = 0, last_event = 0;
  std::optional<Vec3d> view;
  BodyId controlled;
  PlayerLimits limits;
  std::vector<std::uint8_t> joints;
  bool ended = false;
};

// The news for a connection that was sent `sent`; notes them there. Nothing if there are none, or the player's
// body is not owned here; `sent` is forgotten then.
std::optional<v1::RegionControl> NewsFor(const region::Region& region, PlayerNumber player,
                                         std::optional<SentNews>& sent);

class PlayerNewsFeed {
 public:
  explicit PlayerNewsFeed(WorkerMetrics& metrics) : metrics_(metrics) {}
  void AfterTick(const region::Region& region, GamePort& port);

 private:
  WorkerMetrics& metrics_;
  std::map<net::PeerHandle, std::optional<SentNews>> sent_;
};

}  // namespace tessera::worker
