// The tiles of a large level: fetched from the regions as the view reaches them, once the scene is here.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "client_sdk/client_impl.h"

namespace tessera::client {
namespace {

// Work of a poll on tiles: they come while the world is shown, and predicted.
constexpr std::int64_t kTileUnitsAPoll = kUnitsAPoll / 2;
// Ground that prediction may need about the own body, with what it goes by while the next tiles come.
constexpr double kPredictionNeeds_m = 250;
// A region that has sent nothing for so long is asked no more while there is another; and nobody for a moment, so that
// whoever believes to have sent a tile forgets that.
constexpr std::chrono::milliseconds kTilePatience{2000}, kTilePause{300};

}  // namespace

std::vector<TileStore::Place> Client::Impl::TilePlaces() const {
  const Scene& scene = *session.scene;
  double radius_m = tile_radius_m > 0 ? tile_radius_m : own.watches() ? 0 : scene.view.radius_m;
  if (radius_m == 0) radius_m = std::numeric_limits<double>::infinity();
  const std::optional<Vec3d> at = own.Position(world, scene);
  std::vector<TileStore::Place> places;
  if (at && prediction.on()) places.push_back({*at, kPredictionNeeds_m});
  if (const std::optional<Vec3d> centre = tile_centre ? tile_centre : at) {
    places.push_back({*centre, radius_m});
  } else if (std::isinf(radius_m) || own.watches()) {
    places.push_back({(scene.bounds.min + scene.bounds.max) * 0.5, radius_m});
  }
  return places;
}

void Client::Impl::ReadTiles(TimePoint now) {
  if (!tiles) return;
  WorkBudget budget(kTileUnitsAPoll);
  tiles->Look(TilePlaces());
  tiles->Work(now, budget);
  figures.Work(budget.spent());
  for (auto& [tile, content] : tiles->TakeGone()) {
    prediction.DropTile(tile);
    leaving_tiles.push_back(std::move(content));
    events.push_back({.kind = ClientEvent::Kind::kTileGone, .tile = tile});
  }
  for (const std::uint32_t tile : tiles->TakeCame()) {
    prediction.AddTile(tile, tiles->TileAt(tile));
    events.push_back({.kind = ClientEvent::Kind::kTileCame, .tile = tile});
  }
}

// The own body's region first: it is the one that is surely there for long.
void Client::Impl::ChooseTileSource(TimePoint now) {
  const bool speaks = tile_source && IsWelcomed(*tile_source) && now - tiles_heard_at < kTilePatience;
  if (speaks) return;
  if (tile_source && IsWelcomed(*tile_source)) tiles_from = now + kTilePause;
  const std::optional<RegionId> owner = world.OwnerOf(own.id());
  std::optional<RegionId> first, next;
  for (const RegionConnection& connection : connections) {
    if (!connection.welcomed()) continue;
    if (!first) first = connection.region();
    if (tile_source && !next && connection.region() > *tile_source) next = connection.region();
  }
  if (!tile_source && owner && IsWelcomed(*owner)) next = owner;
  tile_source = next ? next : first;
  tiles_heard_at = now;
}

void Client::Impl::AskForTiles(TimePoint now) {
  if (!tiles) return;
  std::vector<TileStore::Wish> wishes = tiles->Wishes();
  if (wishes.empty()) tiles_heard_at = now;  // nobody owes anything
  ChooseTileSource(now);
  if (now < tiles_from) wishes.clear();
  const absl::StatusOr<replication::Digest> hash = replication::DigestFrom(session.scene_hash);
  if (!hash.ok()) return;
  for (RegionConnection& connection : connections) {
    const bool sends = tile_source == connection.region();
    figures.Sent(connection.AskForTiles(now, network, *hash, sends ? wishes : std::vector<TileStore::Wish>{}));
  }
}

}  // namespace tessera::client
