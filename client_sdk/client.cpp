#include "client_sdk/client.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"
#include "core/world/prefab.h"
#include "net/join_grant.h"

namespace tessera::client {
namespace {

// Connections at once: a region that comes back takes a new one while the old one fades, and maps may grow.
constexpr std::size_t kSpareConnections = 64, kMaxConnections = 4095;

// Stands in until the scene is here.
const std::shared_ptr<const Scene>& NoScene() {
  static const std::shared_ptr<const Scene> none = [] {
    auto scene = std::make_shared<Scene>();
    scene->bounds = {{-1, -1, -1}, {1, 1, 1}};
    return scene;
  }();
  return none;
}

double SnapshotTicks(const Session& session) { return double(session.tick_rate_hz) / session.snapshot_rate_hz; }

}  // namespace

Client::Impl::Impl(Settings settings_in, Session session_in, std::unique_ptr<net::Endpoint> endpoint)
    : settings(std::move(settings_in)),
      session(std::move(session_in)),
      network(std::move(endpoint)),
      regions(std::move(session.map), session.regions, *NoScene()),
      progress(settings.deadline),
      own(session.player),
      inputs(session.player, session.tick_rate_hz),
      world(session.tick_rate_hz, SnapshotTicks(session)),
      time(session.tick_rate_hz, session.snapshot_rate_hz) {
  network.Simulate(settings.network);
  const std::shared_ptr<const Scene> scene = std::exchange(session.scene, NoScene());
  if (scene != nullptr) {
    EnterScene(TimePoint(), scene);
    return;
  }
  delivery.Begin(session.scene_hash, settings.scene_cache_dir, std::move(settings.packed_scene));
  // One that is here and small is read at once.
  if (delivery.reads()) ReadScene(TimePoint());
  progress.BeginJoining();
}

absl::StatusOr<std::unique_ptr<Client>> Client::Begin(Settings settings, Session session) {
  const std::size_t peers = std::min(2 * session.regions.size() + kSpareConnections, kMaxConnections);
  auto endpoint = net::Endpoint::Create({.bind_address = settings.bind_address,
                                         .max_peers = peers,
                                         .datagrams_per_service = kDatagramsAPoll,
                                         .datagrams_per_peer = kDatagramsAPoll});
  if (!endpoint.ok()) {
    if (settings.leave && !settings.returning && !IsViewer(session.player)) {
      (void)settings.leave(session.credentials, settings.deadline);
    }
    return endpoint.status();
  }
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Impl>(std::move(settings), std::move(session), *std::move(endpoint))));
}

absl::StatusOr<std::unique_ptr<Client>> Client::JoinByGrant(std::span<const std::uint8_t> grant,
                                                            const GrantOptions& options) {
  absl::StatusOr<net::JoinGrant> read = net::DecodeJoinGrant(grant);
  if (!read.ok()) return read.status();
  Settings settings{.instance_id = read->credentials.instance_id,
                    .deadline = options.deadline,
                    .bind_address = options.bind_address,
                    .network = options.network,
                    .predict = options.predict,
                    .returning = false,
                    .by_grant = true,
                    .scene_cache_dir = options.scene_cache_dir,
                    .packed_scene = options.packed_scene,
                    .leave = options.leave};
  Session session = SessionFrom(*std::move(read));
  session.scene = options.scene;
  return Begin(std::move(settings), std::move(session));
}

absl::Status Client::Renew(std::span<const std::uint8_t> grant) {
  if (impl_->playback) return absl::FailedPreconditionError("a recording needs no grant");
  if (impl_->progress.ended()) return absl::FailedPreconditionError("the client has ended");
  absl::StatusOr<net::JoinGrant> read = net::DecodeJoinGrant(grant);
  if (!read.ok()) return read.status();
  const std::string& instance = read->credentials.instance_id;
  if (instance != impl_->settings.instance_id) {
    return absl::InvalidArgumentError(
        absl::StrCat("grant: is for instance ", instance, ", not for ", impl_->settings.instance_id));
  }
  OwnBody& own = impl_->own;
  if (read->player != own.player() && !(IsViewer(read->player) && own.watches())) {
    return absl::InvalidArgumentError(
        absl::StrCat("grant: is for player ", read->player.value(), ", not for ", own.player().value()));
  }
  if (own.watches()) own.Renumber(read->player);
  impl_->Renew(SessionFrom(*std::move(read)));
  return absl::OkStatus();
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() { (void)impl_->recording.End(); }

std::vector<ClientEvent> Client::Poll(TimePoint now) {
  Impl& me = *impl_;
  if (me.progress.ended()) return std::exchange(me.events, {});
  const TimePoint begin = Clock::now();
  me.since_last_poll = me.last_poll.has_value() ? now - *me.last_poll : std::chrono::nanoseconds(0);
  me.figures.BeginPoll(me.last_poll ? std::optional(me.since_last_poll) : std::nullopt);
  me.last_poll = now;
  me.tiles.LetGo();
  if (me.playback) {
    me.PlayBack(now);
    me.figures.MeasureRates(now);
    return std::exchange(me.events, {});
  }
  me.Receive(now);
  me.Correct();
  me.prediction.ExpireThrown(now, me.time.clock(), me.world, me.events);
  if (!me.progress.ended()) {
    me.ReadScene(now);
  }
  if (!me.progress.ended()) {
    me.AskForScene(now);
    me.ReadTiles(now);
    me.AskForTiles(now);
    me.world.Expire(now, me.events);
    me.Follow(now);
    me.SettlePairs(now);
    me.CheckProgress(now);
  }
  if (!me.progress.ended()) {
    me.regions.Dial(now, me.network, me.session.credentials);
    me.MakeInputs(now);
    me.SendInputs(now);
    me.SendCommands(now);
  }
  me.network.Flush();
  me.recording.EndPoll(now, me.progress.ended(), me.events);
  me.figures.MeasureRates(now);
  me.figures.EndPoll(Clock::now() - begin);
  return std::exchange(me.events, {});
}

std::vector<ShownBody> Client::Interpolated(TimePoint now) {
  const TimePoint begin = Clock::now();
  const double tick = impl_->time.Advance(now);
  std::vector<ShownBody> shown = impl_->world.At(tick, impl_->session.tick_rate_hz);
  impl_->on_paths.AddTo(shown, tick / impl_->session.tick_rate_hz);
  impl_->prediction.Show(now, impl_->inputs.clock().Phase(now), impl_->time.clock(), impl_->world, shown);
  impl_->figures.Interpolated(Clock::now() - begin);
  return shown;
}

absl::Status Client::Leave(std::chrono::milliseconds deadline) {
  if (impl_->playback || impl_->own.watches()) {
    impl_->End(absl::OkStatus(), "left");
    (void)impl_->recording.End();
    return absl::OkStatus();
  }
  const absl::Status status =
      impl_->settings.leave ? impl_->settings.leave(impl_->session.credentials, deadline) : absl::OkStatus();
  impl_->End(absl::OkStatus(), "left");
  (void)impl_->recording.End();  // a caller who wants the status has called StopRecording
  impl_->network.Flush();
  return status;
}

ClientState Client::state() const { return impl_->progress.state(); }
absl::Status Client::reason() const { return impl_->progress.reason(); }
bool Client::needs_new_grant() const { return impl_->progress.needs_new_grant(); }
PlayerNumber Client::player() const { return impl_->own.watches() ? PlayerNumber() : impl_->own.player(); }
BodyId Client::own_body() const { return impl_->own.watches() ? BodyId() : impl_->own.id(); }
std::vector<std::uint8_t> Client::return_token() const {
  if (impl_->playback || impl_->own.watches()) return {};
  return ReturnTokenOf(impl_->session.credentials);
}
const Scene& Client::scene() const { return *impl_->session.scene; }
const PartitionMap& Client::map() const { return impl_->regions.map(); }
WorldClock Client::clock() const { return impl_->time.clock(); }
Tick Client::tick() const { return impl_->time.newest(); }
std::uint32_t Client::last_applied_input() const { return impl_->inputs.last_applied(); }
const std::map<BodyId, SeenBody>& Client::World() const { return impl_->world.bodies(); }
const BodyDef* Client::DefOf(BodyId body) const {
  const Scene& scene = *impl_->session.scene;
  if (IsPlayerBody(body)) return scene.player ? &scene.player->body : nullptr;
  if (IsSpawned(body)) {
    SpawnedId made = PartsOf(body);
    if (made.maker == kMadeHere) made.maker = 1;  // it looks as the game's will
    return PrefabBodyOf(scene, SpawnedBodyId(made));
  }
  const auto found = std::lower_bound(scene.bodies.begin(), scene.bodies.end(), body,
                                      [](const BodyDef& def, BodyId wanted) { return def.id < wanted; });
  if (found != scene.bodies.end() && found->id == body) return &*found;
  const TileStore* tiles = impl_->tiles.store();
  const TilePart* part = tiles != nullptr ? tiles->PartOf(body) : nullptr;
  return part != nullptr ? &part->body : nullptr;
}
const LevelIndex* Client::Tiles() const {
  const TileStore* tiles = impl_->tiles.store();
  return tiles != nullptr ? &tiles->index() : nullptr;
}
std::shared_ptr<const Tile> Client::TileAt(std::uint32_t tile) const {
  const TileStore* tiles = impl_->tiles.store();
  return tiles != nullptr && tile < tiles->index().tiles.size() ? tiles->TileAt(tile) : nullptr;
}
void Client::ViewTiles(std::optional<Vec3d> centre, double radius_m) { impl_->tiles.View(centre, radius_m); }
std::optional<PropertyValue> Client::PropertyOf(BodyId body, std::string_view name) const {
  const Scene& scene = *impl_->session.scene;
  const auto& world = impl_->world.bodies();
  const auto seen = world.find(body);
  PropertySet changed;
  if (seen != world.end() && seen->second.properties != nullptr) {
    absl::StatusOr<PropertySet> received = PropertySet::Decode(*seen->second.properties, scene.properties);
    if (received.ok()) changed = *std::move(received);
  }
  const BodyDef* def = DefOf(body);
  return def == nullptr ? std::nullopt : ValueOf(scene.properties, def->properties, changed, name);
}
ClientStats Client::Stats() const { return impl_->Stats(); }
void Client::SimulateNetwork(const NetworkConditions& conditions) { impl_->network.Simulate(conditions); }

ClientStats Client::Impl::Stats() const {
  const Impl& me = *this;
  ClientStats stats;
  me.figures.AddTo(stats);
  for (const RegionConnection& connection : std::as_const(me.regions).all()) {
    stats.regions.push_back(connection.Stats(me.network));
    stats.datagrams_lost += stats.regions.back().datagrams_lost;
    stats.datagrams_passed_over += stats.regions.back().datagrams_passed_over;
    stats.decode_errors += stats.regions.back().decode_errors;
    stats.reconnects += stats.regions.back().reconnects;
    const bool owner = me.world.OwnerOf(me.own.id()) == connection.region();
    if (connection.welcomed() && (owner || stats.round_trip_s == 0))
      stats.round_trip_s = stats.regions.back().round_trip_s;
  }
  stats.bodies = me.world.bodies().size();
  const PlayoutClock& playout = me.time.playout();
  stats.tick_rate_hz = playout.tick_rate_hz();
  stats.snapshot_delay_s = playout.delay_s();
  stats.jitter_s = playout.jitter_s();
  stats.extrapolations = me.world.extrapolations();
  stats.input_margin_ticks = me.inputs.clock().margin_ticks();
  me.prediction.AddTo(stats);
  if (const TileStore* store = me.tiles.store()) {
    stats.tiles = store->here();
    stats.tile_bytes = store->bytes_here();
    stats.tiles_damaged = store->damaged();
    stats.last_tile_damage = store->last_damage();
  }
  stats.playout_jumps = playout.jumps();
  return stats;
}

}  // namespace tessera::client
