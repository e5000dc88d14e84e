// PlayerPlaces: where the players' bodies are, and of which teams, as the regions that own them say.
//
// A client's view is centred on its body, in every region, and a client is never asked where that is. The owner
// reports it to its neighbours, each passes on what is new to it, so all regions know however far they are away: a body
// that moves is reported when it has moved a little, one that stands once a second. Of two reports of one body that of
// the higher epoch counts, then the later one; an old report counts no more, and then nobody knows.
//
//   PlayerPlaces places(scene.tick_rate_hz);
//   places.Follow(region);                                                // after each step
//   const Bytes news = places.Write(region.tick());                       // empty: nothing is new
//   for (const RegionId neighbor : region.neighbors()) send(neighbor, news);
//   ...
//   if (absl::Status status = places.Receive(bytes, region.tick()); !status.ok()) ...
//   std::optional<Vec3d> centre = places.At(player, region.tick());
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/region/region.h"
#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera::worker {

// The last word of a region about a player's body.
struct PlayerPlace {
  Epoch epoch;
  Tick tick;
  Vec3d position;
  TeamId team = 0;
};

class PlayerPlaces {
 public:
  // A body that moved so far is reported anew: little against any radius of interest.
  static constexpr double kMoved_m = 0.5;

  explicit PlayerPlaces(std::uint32_t tick_rate_hz) : tick_rate_hz_(tick_rate_hz) {}

  // Takes over the places of players' bodies that this region owns.
  void Follow(const region::Region& region);
  // The same of one body.
  void Report(PlayerNumber player, Epoch epoch, Tick tick, Vec3d position, TeamId team);
  // A message for every neighbour, ten times a second if there is anything new; else empty.
  std::vector<std::uint8_t> Write(Tick tick);
  // A neighbour's message, without its first byte. Errors: INVALID_ARGUMENT that names the field; nothing of it was
  // used. A report of a tick far ahead of this region's is passed over: it would be the newest for ever.
  absl::Status Receive(std::span<const std::uint8_t> message, Tick tick);
  std::optional<Vec3d> At(PlayerNumber player, Tick tick) const;
  TeamId TeamAt(PlayerNumber player, Tick tick) const;  // 0 where nobody knows

 private:
  struct Player {
    PlayerPlace newest;
    std::optional<PlayerPlace> sent;
  };
  bool IsNews(const Player& player) const;
  bool IsOld(const PlayerPlace& place, Tick tick) const;
  const PlayerPlace* Find(PlayerNumber player, Tick tick) const;

  std::uint32_t tick_rate_hz_;
  Tick written_at_;
  std::map<PlayerNumber, Player> players_;
};

}  // namespace tessera::worker
