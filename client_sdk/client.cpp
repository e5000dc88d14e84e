#include "client_sdk/client.h"

#include <algorithm>

#include "client_sdk/client_impl.h"
#include "core/world/prefab.h"

namespace tessera::client {
namespace {

constexpr std::chrono::milliseconds kTrafficWindow{1000}, kTrafficStep{50};
// Connections at once: a region that comes back takes a new one while the old one fades, and maps may grow.
constexpr std::size_t kSpareConnections = 64, kMaxConnections = 4095;

// The bodies of the scene and its players, and those of players who have left and are not known to be gone.
std::size_t BodiesAtMost(const Scene& scene) { return scene.bodies.size() + 2 * kMaxPlayers; }

double SnapshotTicks(const Session& session) { return double(session.tick_rate_hz) / session.snapshot_rate_hz; }

}  // namespace

Client::Impl::Impl(const JoinOptions& options_in, Session session_in, std::unique_ptr<net::Endpoint> endpoint)
    : options(options_in),
      session(std::move(session_in)),
      network(std::move(endpoint)),
      interest_radius_m(replication::SnapshotSettingsFor(*session.scene).interest_radius_m),
      world(session.tick_rate_hz, SnapshotTicks(session), session.scene->properties, BodiesAtMost(*session.scene)),
      playout(session.tick_rate_hz, session.snapshot_rate_hz),
      clock{.paused = false, .ticks_per_second = static_cast<double>(session.tick_rate_hz)} {
  network.Simulate(options.network);
  steering.body = PlayerBodyId(session.player);
  if (options.predict && session.scene->player && !Watches()) predictor.emplace(session.scene, session.player);
  for (const RegionEndpoint& region : session.regions) {
    endpoints.emplace(region.region, region);
    connections.emplace_back(region, session.scene->bounds, replication::SnapshotSettingsFor(*session.scene));
  }
}

absl::StatusOr<std::unique_ptr<Client>> Client::Join(const JoinOptions& options) {
  absl::StatusOr<Session> session =
      JoinInstance({options.control_address, options.credentials}, options.instance_id, options.player_name,
                   options.returning, options.watch, options.deadline);
  if (!session.ok()) return session.status();
  const std::size_t peers = std::min(2 * session->regions.size() + kSpareConnections, kMaxConnections);
  auto endpoint = net::Endpoint::Create({.bind_address = options.bind_address, .max_peers = peers});
  if (!endpoint.ok()) {
    if (options.returning.empty() && !options.watch) {
      (void)LeaveInstance({options.control_address, options.credentials}, options.instance_id, session->credentials,
                          options.deadline);
    }
    return endpoint.status();
  }
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Impl>(options, *std::move(session), *std::move(endpoint))));
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() { (void)impl_->EndRecording(); }

std::vector<ClientEvent> Client::Poll(TimePoint now) {
  Impl& me = *impl_;
  if (me.state == ClientState::kEnded) return std::exchange(me.events, {});
  const TimePoint begin = Clock::now();
  if (me.last_poll.has_value()) me.frame_time.Add(now - *me.last_poll);
  me.last_poll = now;
  if (me.replay) {
    me.PlayBack(now);
    me.MeasureRates(now);
    return std::exchange(me.events, {});
  }
  me.Receive(now);
  me.Correct();
  if (me.state != ClientState::kEnded) {
    me.world.Expire(now, me.events);
    me.Follow(now);
    me.SettlePairs(now);
    me.CheckProgress(now);
  }
  if (me.state != ClientState::kEnded) {
    for (RegionConnection& connection : me.connections) connection.DialIfDue(now, me.network, me.session.credentials);
    me.MakeInputs(now);
    me.SendInputs(now);
    me.SendCommands(now);
  }
  me.network.Flush();
  me.RecordEvents(now);
  me.MeasureRates(now);
  me.network_time.Add(Clock::now() - begin);
  return std::exchange(me.events, {});
}

void Client::Impl::MeasureRates(TimePoint now) {
  if (!traffic.empty() && now - traffic.back().time < kTrafficStep) return;
  traffic.push_back({now, bytes_in, bytes_out});
  while (now - traffic.front().time > kTrafficWindow) traffic.pop_front();
}

std::vector<ShownBody> Client::Interpolated(TimePoint now) {
  const TimePoint begin = Clock::now();
  const double tick = impl_->playout.Advance(now);
  impl_->shown_tick = tick;
  std::vector<ShownBody> shown = impl_->world.At(tick, impl_->session.tick_rate_hz);
  impl_->ShowOnPaths(tick, shown);
  impl_->ShowPredicted(now, shown);
  impl_->update_time.Add(Clock::now() - begin);
  return shown;
}

absl::Status Client::Leave(std::chrono::milliseconds deadline) {
  if (impl_->replay || impl_->Watches()) {
    impl_->End(absl::OkStatus(), "left");
    (void)impl_->EndRecording();
    return absl::OkStatus();
  }
  const absl::Status status = LeaveInstance({impl_->options.control_address, impl_->options.credentials},
                                            impl_->options.instance_id, impl_->session.credentials, deadline);
  impl_->End(absl::OkStatus(), "left");
  (void)impl_->EndRecording();  // a caller who wants the status has called StopRecording
  impl_->network.Flush();
  return status;
}

ClientState Client::state() const { return impl_->state; }
absl::Status Client::reason() const { return impl_->reason; }
PlayerNumber Client::player() const { return impl_->Watches() ? PlayerNumber() : impl_->session.player; }
BodyId Client::own_body() const { return impl_->Watches() ? BodyId() : PlayerBodyId(impl_->session.player); }
std::vector<std::uint8_t> Client::return_token() const {
  if (impl_->replay || impl_->Watches()) return {};
  return ReturnTokenOf(impl_->session.credentials);
}
const Scene& Client::scene() const { return *impl_->session.scene; }
const PartitionMap& Client::map() const { return impl_->session.map; }
WorldClock Client::clock() const { return impl_->clock; }
Tick Client::tick() const { return impl_->newest_tick; }
std::uint32_t Client::last_applied_input() const { return impl_->last_applied_input; }
const std::map<BodyId, SeenBody>& Client::World() const { return impl_->world.bodies(); }
const BodyDef* Client::DefOf(BodyId body) const {
  const Scene& scene = *impl_->session.scene;
  if (IsPlayerBody(body)) return scene.player ? &scene.player->body : nullptr;
  if (IsSpawned(body)) return PrefabBodyOf(scene, body);
  const auto found = std::lower_bound(scene.bodies.begin(), scene.bodies.end(), body,
                                      [](const BodyDef& def, BodyId wanted) { return def.id < wanted; });
  return found == scene.bodies.end() || found->id != body ? nullptr : &*found;
}
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
  stats.bytes_in = me.bytes_in;
  stats.bytes_out = me.bytes_out;
  if (me.traffic.size() > 1) {
    const double span_s = std::chrono::duration<double>(me.traffic.back().time - me.traffic.front().time).count();
    stats.bytes_in_per_s = static_cast<double>(me.traffic.back().in - me.traffic.front().in) / span_s;
    stats.bytes_out_per_s = static_cast<double>(me.traffic.back().out - me.traffic.front().out) / span_s;
  }
  stats.datagrams_lost = me.dropped.datagrams_lost;
  stats.decode_errors = me.dropped.decode_errors;
  stats.reconnects = me.dropped.reconnects;
  for (const RegionConnection& connection : me.connections) {
    stats.regions.push_back(connection.Stats(me.network));
    stats.datagrams_lost += stats.regions.back().datagrams_lost;
    stats.decode_errors += stats.regions.back().decode_errors;
    stats.reconnects += stats.regions.back().reconnects;
    const bool own = me.world.OwnerOf(PlayerBodyId(me.session.player)) == connection.region();
    if (connection.welcomed() && (own || stats.round_trip_s == 0))
      stats.round_trip_s = stats.regions.back().round_trip_s;
  }
  stats.full_records = me.full_records;
  stats.delta_records = me.delta_records;
  stats.inputs_refused = me.inputs_refused;
  stats.bodies = me.world.bodies().size();
  stats.tick_rate_hz = me.playout.tick_rate_hz();
  stats.snapshot_delay_s = me.playout.delay_s();
  stats.jitter_s = me.playout.jitter_s();
  stats.extrapolations = me.world.extrapolations();
  stats.input_margin_ticks = me.input_clock.margin_ticks();
  if (me.predictor) {
    stats.corrections = me.predictor->corrections();
    stats.last_correction_m = me.predictor->last_correction_m();
  }
  stats.playout_jumps = me.playout.jumps();
  stats.frame_time = me.frame_time.Summary();
  stats.network_time = me.network_time.Summary();
  stats.update_time = me.update_time.Summary();
  return stats;
}

}  // namespace tessera::client
