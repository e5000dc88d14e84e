// PlayerPlaces: where the players' bodies are, by the word of the regions that own them.
//
// What a client is shown is centred on its body, in every region, and a client is never asked where that is. The owner
// tells its neighbours, each passes on what is new to it, so all regions hear of it however far they are away: a body
// that moves at once when it has moved a little, one that stands once a second. Of two words about one body that of the
// higher epoch counts, then the later one; an old word counts no more, and then nobody knows.
//
//   PlayerPlaces places(scene.tick_rate_hz);
//   places.Follow(region.tick(), region.owned());                         // after each step
//   const Bytes news = places.Tell(region.tick());                        // empty: nothing to tell
//   for (const RegionId neighbor : region.neighbors()) links.SendNow(neighbor, news);
//   ...
//   if (absl::Status status = places.Hear(bytes, region.tick()); !status.ok()) ...
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

class PlayerPlaces {
 public:
  // A body that moved so far is told of anew: little against any radius of interest.
  static constexpr double kMoved_m = 0.5;

  explicit PlayerPlaces(std::uint32_t tick_rate_hz) : tick_rate_hz_(tick_rate_hz) {}

  // What this region owns, ascending by id.
  void Follow(Tick tick, std::span<const region::OwnedBody> owned);
  // A message for every neighbour, ten times a second if there is anything new; else empty.
  std::vector<std::uint8_t> Tell(Tick tick);
  // A neighbour's, without its first byte. Errors: INVALID_ARGUMENT, names what; nothing of it was used. A word of a
  // tick far ahead of this region's is passed over: it would be the newest for ever.
  absl::Status Hear(std::span<const std::uint8_t> message, Tick tick);
  std::optional<Vec3d> At(PlayerNumber player, Tick tick) const;

 private:
  struct Word {
    Epoch epoch;
    Tick tick;
    Vec3d position;
  };
  struct Known {
    Word word;
    std::optional<Word> told;
  };
  bool IsNews(const Known& known) const;
  bool IsOld(const Word& word, Tick tick) const;

  std::uint32_t tick_rate_hz_;
  Tick told_at_;
  std::map<PlayerNumber, Known> known_;
};

}  // namespace tessera::worker
