// TileView: the tiles of a large level that a client has: about its body, or about the place that the program views.
//
//   view.Begin(scene, index, cache_dir);                           // the scene is here, and its level has tiles
//   auto [gone, came] = view.Work(now, view.Places(...), budget);  // once a poll
//   Send(view.Wishes(now, welcomed, owner));                       // to the region that IsSource, to others none
//   view.Take(now, region, chunk);                                 // a part came
//
// Promise: a tile that goes is valid until LetGo, so that the program may draw it for the rest of the frame. Where the
// level has no tiles, nothing is wished for.
// Thread rule: one thread at a time; time comes in. Work touches files.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/region_source.h"
#include "client_sdk/tile_store.h"

namespace tessera::client {

class TileView {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Wish = TileStore::Wish;

  // As TileStore.
  void Begin(std::shared_ptr<const Scene> scene, std::shared_ptr<const LevelIndex> index, std::string cache_dir);
  const TileStore* store() const { return store_ ? &*store_ : nullptr; }  // null: the level has no tiles
  // As Client::ViewTiles.
  void View(std::optional<Vec3d> centre, double radius_m);
  // The places whose surroundings are wanted. `at`: of the own body, OwnBody::Position. `predicts`: its ground, too.
  std::vector<TileStore::Place> Places(const Scene& scene, const std::optional<Vec3d>& at, bool watches,
                                       bool predicts) const;

  struct Changes {
    std::vector<std::uint32_t> gone{}, came{};
  };
  // Reads what is here about these places.
  Changes Work(TimePoint now, std::vector<TileStore::Place> places, WorkBudget& budget);
  // The tiles that have gone by the last Work are not needed any more.
  void LetGo() { leaving_.clear(); }

  // The tiles that the region that IsSource is to send, the nearest first. `welcomed`: those that could, ascending.
  // `preferred`: that of the own body, which is surely there for long.
  std::vector<Wish> Wishes(TimePoint now, std::span<const RegionId> welcomed, std::optional<RegionId> preferred);
  bool IsSource(RegionId region) const { return source_.is(region); }
  void Take(TimePoint now, RegionId from, const replication::TileChunk& chunk);

 private:
  std::optional<TileStore> store_;
  std::optional<Vec3d> centre_;  // given by the caller
  double radius_m_ = 0;
  RegionSource source_;
  TimePoint none_before_{};                           // until then none is asked for
  std::vector<std::shared_ptr<const Tile>> leaving_;  // until LetGo
};

}  // namespace tessera::client
