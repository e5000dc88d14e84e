// The tiles of a large level: fetched from the regions as the view reaches them, once the scene is here.
#include <optional>
#include <vector>

#include "client_sdk/client_impl.h"

namespace tessera::client {
namespace {

// Work of a poll on tiles: they come while the world is shown, and predicted.
constexpr std::int64_t kTileUnitsAPoll = kUnitsAPoll / 2;

}  // namespace

void Client::Impl::ReadTiles(TimePoint now) {
  if (tiles.store() == nullptr) return;
  WorkBudget budget(kTileUnitsAPoll);
  const std::optional<Vec3d> at = own.Position(world, *session.scene);
  const TileView::Changes changes =
      tiles.Work(now, tiles.Places(*session.scene, at, own.watches(), prediction.on()), budget);
  figures.Work(budget.spent());
  for (const std::uint32_t tile : changes.gone) {
    prediction.DropTile(tile);
    events.push_back({.kind = ClientEvent::Kind::kTileGone, .tile = tile});
  }
  for (const std::uint32_t tile : changes.came) {
    prediction.AddTile(tile, tiles.store()->TileAt(tile));
    events.push_back({.kind = ClientEvent::Kind::kTileCame, .tile = tile});
  }
}

// The own body's region first: it is the one that is surely there for long.
void Client::Impl::AskForTiles(TimePoint now) {
  if (tiles.store() == nullptr) return;
  const std::vector<TileView::Wish> wishes = tiles.Wishes(now, regions.Welcomed(), world.OwnerOf(own.id()));
  const absl::StatusOr<replication::Digest> hash = replication::DigestFrom(session.scene_hash);
  if (!hash.ok()) return;
  for (RegionConnection& connection : regions.all()) {
    const bool sends = tiles.IsSource(connection.region());
    figures.Sent(connection.AskForTiles(now, network, *hash, sends ? wishes : std::vector<TileView::Wish>{}));
  }
}

}  // namespace tessera::client
