// WorldNewsFeed: sends each client the properties of the world, at the beginning of its connection and whenever they
// change: those that every client may see, as no death takes them back.
//
// Every region knows them, so a client hears them from each that it is connected to, and passes over what it has.
//
//   feed.AfterTick(region, port);   // after each tick
//
// Thread rule: one thread.
#pragma once

#include <map>
#include <optional>
#include <utility>

#include "core/region/region.h"
#include "net/endpoint.h"
#include "region_worker/game_port.h"
#include "tessera/v1/game.pb.h"

namespace tessera::worker {

// Which properties of the world a connection was sent: of the ownership with this epoch, as of this tick.
using WorldVersion = std::pair<Epoch, Tick>;

// The news for a connection that was sent `sent`; notes them there. Nothing if there are none.
std::optional<v1::RegionControl> WorldNewsFor(const region::Region& region, std::optional<WorldVersion>& sent);

class WorldNewsFeed {
 public:
  void AfterTick(const region::Region& region, GamePort& port);

 private:
  std::map<net::PeerHandle, std::optional<WorldVersion>> sent_;
};

}  // namespace tessera::worker
