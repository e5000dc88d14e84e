// PlayerRoster: the players that the orders name, and what becomes of their bodies here.
//
// The region that owns a player's spawn point makes its body, once. A player that has left loses its body wherever that
// is, and it may be on its way from another region when its player leaves: so all regions are asked again and again.
// A player whose generation is raised has been joined by another process: the connections of the one before end.
// Players are numbered as they come, and an order that names one no more has forgotten that it left.
//
//   PlayerRoster roster(scene.player.has_value());
//   roster.Set(order.players, order.joins_running, region, actions);
//   before each step: roster.RemoveLeft(region);   after it: roster.CountSpawned(region);
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/region/region.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/order.h"

namespace tessera::worker {

class PlayerRoster {
 public:
  explicit PlayerRoster(bool players_have_bodies) : players_have_bodies_(players_have_bodies) {}

  // Whole state, ascending by number: players that are new are spawned, those that left are expelled, the parked stand
  // still. `joins`: this worker is only about to join the world, and an earlier life of the region made the bodies that
  // it is to make. One who is as before costs a look.
  void Set(std::span<const OrderedPlayer> players, bool joins, region::Region& region, Actions& actions);
  void RemoveLeft(region::Region& region) const;
  void CountSpawned(const region::Region& region);
  std::uint64_t spawned() const { return spawned_; }  // bodies that were made here

 private:
  // How far the newest order was followed in one that it names.
  struct Known {
    PlayerNumber number;
    net::Generation generation{};  // the highest that was named
    bool left = false, parked = false;
    bool asked_to_spawn = false;
  };

  void Take(const OrderedPlayer& player, bool joins, Known& known, region::Region& region, Actions& actions);
  bool HasLeft(PlayerNumber player) const;

  bool players_have_bodies_;
  std::vector<Known> known_;            // ascending by number
  PlayerNumber newest_named_;           // by any order
  std::vector<PlayerNumber> spawning_;  // asked for, not seen yet
  std::uint64_t spawned_ = 0;
};

}  // namespace tessera::worker
