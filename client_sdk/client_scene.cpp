// The scene: fetched from the regions while the client joins, then entered.
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"

namespace tessera::client {
namespace {

// The bodies of the scene and its players, and those of players who have left and are not known to be gone.
std::size_t BodiesAtMost(const Scene& scene) { return scene.bodies.size() + 2 * kMaxPlayers; }

}  // namespace

void Client::Impl::EnterScene(TimePoint now, std::shared_ptr<const Scene> scene,
                              std::shared_ptr<const LevelIndex> index) {
  session.scene = std::move(scene);
  if (index != nullptr) tiles.Begin(session.scene, index, settings.scene_cache_dir);
  world = WorldView(session.tick_rate_hz, static_cast<double>(session.tick_rate_hz) / session.snapshot_rate_hz,
                    session.scene->properties, BodiesAtMost(*session.scene));
  on_paths = BodiesOnPaths(session.scene);
  if (settings.predict && session.scene->player && !own.watches()) {
    const absl::Status fits = prediction.Begin(session.scene, own.player(), std::move(index));
    if (!fits.ok()) {
      events.push_back({.kind = ClientEvent::Kind::kMovementMissing,
                        .body = own.player_body(),
                        .detail = std::string(fits.message())});
    }
  }
  regions.Begin(*session.scene);
  for (const RegionId region : regions.Welcomed()) world.RegionBegins(now, region);
  properties.Begin(session.scene->instance_properties, events);
}

void Client::Impl::OnSceneMessage(TimePoint now, RegionConnection& connection, const net::Bytes& bytes) {
  const auto message = replication::DecodeSceneMessage(bytes);
  if (!message.ok()) return connection.CountError();
  if (const auto* chunk = std::get_if<replication::TileChunk>(&*message)) {
    return tiles.Take(now, connection.region(), *chunk);
  }
  if (!delivery.under_way()) return;  // the rest of what was on its way
  if (const auto* refusal = std::get_if<replication::SceneRefusal>(&*message)) {
    return End(absl::InternalError(absl::StrCat(connection.Where(), " does not send the scene: ", refusal->why)), "");
  }
  const absl::StatusOr<bool> fresh =
      delivery.Take(now, connection.region(), std::get<replication::SceneChunk>(*message));
  if (!fresh.ok()) return End(fresh.status(), "");
  if (*fresh) progress.Step(now);
}

// A part with each poll.
void Client::Impl::ReadScene(TimePoint now) {
  WorkBudget budget(kUnitsAPoll);
  const bool reads = delivery.reads();
  absl::StatusOr<SceneDelivery::Read> read = delivery.Work(budget);
  if (!read.ok()) return End(read.status(), "");
  if (reads) progress.Step(now);  // nobody else is to blame for how long this takes
  if (read->scene != nullptr) EnterScene(now, std::move(read->scene), std::move(read->index));
  figures.Work(budget.spent());
}

void Client::Impl::AskForScene(TimePoint now) {
  if (delivery.under_way()) delivery.Choose(now, regions.Welcomed());
  for (RegionConnection& connection : regions.all()) {
    if (!connection.welcomed() || (!delivery.under_way() && !connection.holds())) continue;
    figures.Sent(connection.AskForScene(now, network, delivery.RequestTo(connection.region())));
  }
}

}  // namespace tessera::client
