// TileStore: the tiles of a large level that a client has: those within a radius of its places, the nearest first.
//
// They come from the folder that keeps them, or from the regions a part at a time (core/replication/scene_transfer.h),
// and count once their SHA-256 is that of the scene's list and every number in them has been checked. All of that goes
// on a little with each poll. Tiles that are well beyond the radius are dropped, so memory is bounded by what is near.
//
//   TileStore tiles(scene, index, cache_dir);
//   tiles.Look({{own.position, 300}});                      // once a poll
//   tiles.Work(now, budget);
//   Send(tiles.Wishes(now));  ...  tiles.Take(now, chunk);  // with a region
//   for (const std::uint32_t tile : tiles.TakeCame()) Draw(*tiles.TileAt(tile));
//
// Thread rule: one thread at a time; time comes in. Work touches files.
#pragma once

#include <chrono>
#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/scene_keeper.h"
#include "client_sdk/work_budget.h"
#include "core/replication/scene_transfer.h"
#include "core/world/level_tiles.h"
#include "core/world/packed_scene.h"
#include "core/world/scene.h"

namespace tessera::client {

class TileStore {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Wish = replication::TileRequest::Wish;

  // A damaged tile is asked for again after so long, twice as long each time up to the second.
  static constexpr std::chrono::milliseconds kTryAgain{500}, kTryAgainAtMost{30'000};
  // Tiles are wanted anew when a place has moved by this share of an edge, and dropped so many edges beyond the
  // radius.
  static constexpr double kStepOfEdge = 0.125, kKeepEdges = 1;

  // `cache_dir`: empty: nothing is kept.
  TileStore(std::shared_ptr<const Scene> scene, std::shared_ptr<const LevelIndex> index, std::string cache_dir);

  struct Place {
    Vec3d at;
    double radius_m = 0;  // infinite: all
  };
  // The tiles are wanted whose bounds are within the radius of one of these places, on the ground.
  void Look(std::vector<Place> places);
  // Reads, checks and unpacks what is here.
  void Work(TimePoint now, WorkBudget& budget);
  // The tiles that regions are to send, the nearest first.
  std::vector<Wish> Wishes() const;
  // True if something of it was new.
  bool Take(const replication::TileChunk& chunk);

  const LevelIndex& index() const { return *index_; }
  // Null: not here. `tile` < index().tiles.size().
  const std::shared_ptr<const Tile>& TileAt(std::uint32_t tile) const { return known_[tile].tile; }
  // The part of a body in one of the tiles that are here; null if it is in none.
  const TilePart* PartOf(BodyId body) const;

  // Since the last call. The tiles that have gone come with it: what was taken from them is valid as long.
  std::vector<std::uint32_t> TakeCame() { return std::exchange(came_, {}); }
  std::vector<std::pair<std::uint32_t, std::shared_ptr<const Tile>>> TakeGone() { return std::exchange(gone_, {}); }

  std::size_t here() const { return here_.size(); }
  std::uint64_t bytes_here() const { return bytes_here_; }         // packed
  std::uint64_t damaged() const { return damaged_; }               // that regions sent, so far
  const std::string& last_damage() const { return last_damage_; }  // which tile, and how

 private:
  struct Known {
    std::shared_ptr<const Tile> tile;
    std::uint32_t failures = 0;
    TimePoint not_before{};
  };
  // One that is wanted and not here.
  struct Fetch {
    std::uint32_t tile = 0;
    bool from_folder = false;
    std::ifstream kept{};
    std::vector<std::uint8_t> bytes{};
    std::size_t summed = 0;
    std::unique_ptr<Sha256> sum = std::make_unique<Sha256>();
    std::unique_ptr<TileUnpacker> unpacker{};
  };

  const TileEntry& EntryOf(std::uint32_t tile) const { return index_->tiles[tile]; }
  // The least distance to a place that has it within its radius and `more_m`; nothing if none has.
  std::optional<double> DistanceTo(std::uint32_t tile, double more_m) const;
  std::string FileOf(std::uint32_t tile) const;
  void Choose(TimePoint now, WorkBudget& budget);
  void DropFar();
  Fetch Begin(std::uint32_t tile) const;
  void ReadKept(Fetch& fetch, WorkBudget& budget);
  static void AskRegions(Fetch& fetch);
  bool IsWhole(const Fetch& fetch) const { return fetch.bytes.size() == EntryOf(fetch.tile).bytes; }
  // True once it is over, well or not.
  bool Read(TimePoint now, Fetch& fetch, WorkBudget& budget);
  void Failed(TimePoint now, Fetch& fetch, const std::string& why);

  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const LevelIndex> index_;
  std::string cache_dir_;
  std::vector<Place> places_, chosen_for_;
  bool choose_ = true;
  std::optional<TimePoint> choose_at_;  // a damaged one may be asked for again
  std::vector<Known> known_;            // by tile
  std::vector<std::uint32_t> here_;
  std::vector<Fetch> under_way_;  // the nearest first
  std::unique_ptr<SceneKeeper> keeper_;
  std::vector<std::uint32_t> came_;
  std::vector<std::pair<std::uint32_t, std::shared_ptr<const Tile>>> gone_;
  std::uint64_t bytes_here_ = 0, damaged_ = 0;
  std::string last_damage_;
};

}  // namespace tessera::client
