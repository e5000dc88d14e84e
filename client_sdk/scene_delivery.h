// SceneDelivery: how the scene comes to a client that joins without one: found or fetched, read, and then kept.
//
//   delivery.Begin(scene_hash, cache_dir, packed);
//   delivery.Choose(now, welcomed);                        // once a poll
//   Send(region, *delivery.RequestTo(region));             // to each
//   delivery.Take(now, region, chunk);                     // a part came
//   if (auto read = delivery.Work(budget); read->scene) Enter(read->scene, read->index);
//
// One region sends it, and all others hold their snapshots back meanwhile (RegionSource). Reading and keeping go on a
// little with each poll (SceneFetch, SceneKeeper).
// Thread rule: one thread at a time; time comes in. Begin and Work touch files.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client_sdk/region_source.h"
#include "client_sdk/scene_fetch.h"
#include "client_sdk/scene_keeper.h"

namespace tessera::client {

class SceneDelivery {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // As SceneFetch.
  void Begin(std::string scene_hash, std::string cache_dir, std::vector<std::uint8_t> packed);
  // Until the scene is here; not before Begin.
  bool under_way() const { return fetch_.has_value(); }
  // Whether all that is awaited is here, and is being read: nobody else is to blame for how long that takes.
  bool reads() const { return fetch_ && (!fetch_->from_regions() || fetch_->complete()); }

  // Chooses who sends it. `welcomed`: the regions that could, ascending.
  void Choose(TimePoint now, std::span<const RegionId> welcomed);
  // Says to the region what it is to do; after the scene is here, that it is.
  replication::SceneRequest RequestTo(RegionId region) const;
  // Whether some of it was new. INTERNAL: as SceneFetch::Take.
  absl::StatusOr<bool> Take(TimePoint now, RegionId from, const replication::SceneChunk& chunk);

  struct Read {
    std::shared_ptr<const Scene> scene{};       // null: not yet
    std::shared_ptr<const LevelIndex> index{};  // its tiles; null if all is in it
  };
  // Goes on with reading what is here, and then with keeping it for the next time. Errors: those of SceneFetch::Go.
  absl::StatusOr<Read> Work(WorkBudget& budget);

 private:
  std::optional<SceneFetch> fetch_;      // until the scene is here
  RegionSource source_;                  // sends its parts
  std::unique_ptr<SceneKeeper> keeper_;  // while the scene is written into the folder
};

}  // namespace tessera::client
