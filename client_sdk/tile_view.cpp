#include "client_sdk/tile_view.h"

#include <cmath>
#include <limits>

namespace tessera::client {
namespace {

// Ground that prediction may need about the own body, with what it goes by while the next tiles come.
constexpr double kPredictionNeeds_m = 250;
// When a region falls silent nobody is asked for a moment, so that whoever believes to have sent a tile forgets that.
constexpr std::chrono::milliseconds kTilePause{300};

}  // namespace

void TileView::Begin(std::shared_ptr<const Scene> scene, std::shared_ptr<const LevelIndex> index,
                     std::string cache_dir) {
  store_.emplace(std::move(scene), std::move(index), std::move(cache_dir));
}

void TileView::View(std::optional<Vec3d> centre, double radius_m) {
  centre_ = centre;
  radius_m_ = radius_m;
}

std::vector<TileStore::Place> TileView::Places(const Scene& scene, const std::optional<Vec3d>& at, bool watches,
                                               bool predicts) const {
  double radius_m = radius_m_ > 0 ? radius_m_ : watches ? 0 : scene.view.radius_m;
  if (radius_m == 0) radius_m = std::numeric_limits<double>::infinity();
  std::vector<TileStore::Place> places;
  if (at && predicts) places.push_back({*at, kPredictionNeeds_m});
  if (const std::optional<Vec3d> centre = centre_ ? centre_ : at) {
    places.push_back({*centre, radius_m});
  } else if (std::isinf(radius_m) || watches) {
    places.push_back({(scene.bounds.min + scene.bounds.max) * 0.5, radius_m});
  }
  return places;
}

TileView::Changes TileView::Work(TimePoint now, std::vector<TileStore::Place> places, WorkBudget& budget) {
  if (!store_) return {};
  store_->Look(std::move(places));
  store_->Work(now, budget);
  Changes changes;
  for (auto& [tile, content] : store_->TakeGone()) {
    changes.gone.push_back(tile);
    leaving_.push_back(std::move(content));
  }
  changes.came = store_->TakeCame();
  return changes;
}

std::vector<TileView::Wish> TileView::Wishes(TimePoint now, std::span<const RegionId> welcomed,
                                             std::optional<RegionId> preferred) {
  std::vector<Wish> wishes = store_ ? store_->Wishes() : std::vector<Wish>();
  if (wishes.empty()) source_.Heard(now);  // nobody owes anything
  if (source_.Choose(now, welcomed, preferred)) none_before_ = now + kTilePause;
  if (now < none_before_) wishes.clear();
  return wishes;
}

void TileView::Take(TimePoint now, RegionId from, const replication::TileChunk& chunk) {
  const bool fresh = store_ && store_->Take(chunk);
  if (fresh && source_.is(from)) source_.Heard(now);
}

}  // namespace tessera::client
