// PairBroadcast: sends the clients of a region which pairs of players' bodies and triggers began or ceased to touch.
// A player who moves another body than its own is sent that one's pairs as well: with the control they begin, and with
// it they end, whatever they touch then.
//
// A client that is new is first sent all pairs that touch. Pairs further away than kReach radii of interest from a
// client's body are left out.
//
//   broadcast.AfterTick(region, result.events, places, port);   // after each tick
//
// Thread rule: one thread.
#pragma once

#include <span>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/physics/contact_report.h"
#include "core/region/region.h"
#include "net/endpoint.h"
#include "region_worker/core/player_places.h"
#include "region_worker/game_port.h"

namespace tessera::worker {

class PairBroadcast {
 public:
  // 0: interest has no radius.
  explicit PairBroadcast(double interest_radius_m) : reach_m_(kReach * interest_radius_m) {}

  // `events`: of the region's last step. `places` knows the teams of players whose bodies other regions own; null where
  // there is only this region.
  void AfterTick(const region::Region& region, std::span<const physics::PairEvent> events, const PlayerPlaces* places,
                 GamePort& port);

 private:
  // Further than bodies are sent: cells and hysteresis reach beyond the radius, and bodies have a size. A client
  // ignores pairs of bodies that it does not see.
  static constexpr double kReach = 2;

  // The other bodies that players of clients move, or moved in the tick before, ascending.
  std::vector<BodyId> OthersMoved(const region::Region& region, const GamePort& port) const;

  double reach_m_;
  // Clients that were sent the pairs that had begun before they came, and the other body that each player moves, or 0.
  absl::flat_hash_map<net::PeerHandle, BodyId> informed_;
};

}  // namespace tessera::worker
