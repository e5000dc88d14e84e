// The scene: fetched from the regions while the client joins, then entered.
#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"

namespace tessera::client {
namespace {

using Want = replication::SceneRequest::Want;

// The bodies of the scene and its players, and those of players who have left and are not known to be gone.
std::size_t BodiesAtMost(const Scene& scene) { return scene.bodies.size() + 2 * kMaxPlayers; }

}  // namespace

void Client::Impl::EnterScene(TimePoint now, std::shared_ptr<const Scene> scene,
                              std::shared_ptr<const LevelIndex> index) {
  fetch.reset();
  session.scene = std::move(scene);
  if (index != nullptr) tiles.emplace(session.scene, index, settings.scene_cache_dir);
  const replication::SnapshotSettings snapshots = replication::SnapshotSettingsFor(*session.scene);
  interest_radius_m = snapshots.interest_radius_m;
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
  for (RegionConnection& connection : connections) {
    connection.Begin(session.scene->bounds, snapshots);
    if (connection.welcomed()) world.RegionBegins(now, connection.region());
  }
  follow_due = true;
  properties.Begin(session.scene->instance_properties, events);
}

void Client::Impl::OnSceneMessage(TimePoint now, RegionConnection& connection, const net::Bytes& bytes) {
  const auto message = replication::DecodeSceneMessage(bytes);
  if (!message.ok()) return connection.CountError();
  if (const auto* chunk = std::get_if<replication::TileChunk>(&*message)) {
    const bool fresh = tiles && tiles->Take(*chunk);
    if (fresh && tile_source == connection.region()) tiles_heard_at = now;
    return;
  }
  if (!fetch) return;  // the rest of what was on its way
  if (const auto* refusal = std::get_if<replication::SceneRefusal>(&*message)) {
    return End(absl::InternalError(absl::StrCat(connection.Where(), " does not send the scene: ", refusal->why)), "");
  }
  const std::uint64_t before = fetch->offset();
  if (absl::Status status = fetch->Take(std::get<replication::SceneChunk>(*message)); !status.ok()) {
    return End(std::move(status), "");
  }
  if (fetch->offset() == before) return;
  if (fetch->source == connection.region()) fetch->heard_at = now;
  joined_by = now + settings.deadline;
}

// A part with each poll: of reading what is here, and then of keeping it for the next time.
void Client::Impl::ReadScene(TimePoint now) {
  WorkBudget budget(kUnitsAPoll);
  if (keeper && keeper->Go(budget)) keeper.reset();
  if (fetch) {
    const bool waits = fetch->from_regions() && !fetch->complete();
    absl::StatusOr<std::shared_ptr<const Scene>> scene = fetch->Go(budget);
    if (!scene.ok()) return End(scene.status(), "");
    if (!waits) joined_by = now + settings.deadline;  // nobody else is to blame for how long this takes
    if (*scene != nullptr) {
      keeper = fetch->TakeKeeper();
      const std::shared_ptr<const LevelIndex> index = fetch->index();
      EnterScene(now, *std::move(scene), index);
    }
  }
  figures.Work(budget.spent());
}

// One region sends the scene. If it dies or falls silent, the next one goes on where it was.
void Client::Impl::ChooseSource(TimePoint now) {
  const bool speaks = fetch->source && IsWelcomed(*fetch->source) && now - fetch->heard_at < SceneFetch::kPatience;
  if (speaks) return;
  const auto welcomed = [](const RegionConnection& connection) { return connection.welcomed(); };
  auto next = std::find_if(connections.begin(), connections.end(), [&](const RegionConnection& connection) {
    return connection.welcomed() && fetch->source && connection.region() > *fetch->source;
  });
  if (next == connections.end()) next = std::find_if(connections.begin(), connections.end(), welcomed);
  if (next == connections.end()) return fetch->source.reset();
  fetch->source = next->region();
  fetch->heard_at = now;
}

void Client::Impl::AskForScene(TimePoint now) {
  if (fetch && fetch->from_regions()) ChooseSource(now);
  for (RegionConnection& connection : connections) {
    if (!connection.welcomed() || (!fetch && !connection.holds())) continue;
    replication::SceneRequest request{.want = Want::kHave};
    if (fetch) {
      request = {.want = fetch->source == connection.region() ? Want::kSend : Want::kHold,
                 .scene_hash = fetch->scene_hash(),
                 .offset = fetch->offset()};
    }
    figures.Sent(connection.AskForScene(now, network, request));
  }
}

}  // namespace tessera::client
