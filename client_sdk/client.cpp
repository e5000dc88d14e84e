#include "client_sdk/client.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client_sdk/client_impl.h"
#include "core/replication/datagram.h"
#include "core/world/partition_io.h"

namespace tessera::client {
namespace {

// Without any region for so long, the instance counts as lost; shorter than that, a failover may bring it back.
constexpr std::chrono::seconds kMaxSilence{30};
constexpr std::chrono::milliseconds kTrafficWindow{1000}, kTrafficStep{50};

double SnapshotTicks(const Session& session) { return double(session.tick_rate_hz) / session.snapshot_rate_hz; }

// What the door and the region behind it say is one list.
static_assert(v1::REFUSAL_REASON_PROTOCOL == static_cast<int>(net::Refused::kProtocol));
static_assert(v1::REFUSAL_REASON_BAD_TOKEN == static_cast<int>(net::Refused::kBadToken));
static_assert(v1::REFUSAL_REASON_WRONG_INSTANCE == static_cast<int>(net::Refused::kWrongInstance));
static_assert(v1::REFUSAL_REASON_EXPIRED_TOKEN == static_cast<int>(net::Refused::kExpired));
static_assert(v1::REFUSAL_REASON_FULL == static_cast<int>(net::Refused::kFull));
static_assert(v1::REFUSAL_REASON_STOPPING == static_cast<int>(net::Refused::kStopping));
static_assert(v1::REFUSAL_REASON_WRONG_REGION == static_cast<int>(net::Refused::kWrongRegion));

v1::RegionRefusal ToProto(const net::Refusal& refusal) {
  v1::RegionRefusal proto;
  proto.set_reason(static_cast<v1::RefusalReason>(refusal.reason));
  proto.set_detail(refusal.detail);
  return proto;
}

absl::StatusCode CodeOf(v1::RefusalReason reason) {
  switch (reason) {
    case v1::REFUSAL_REASON_BAD_TOKEN:
      return absl::StatusCode::kUnauthenticated;
    case v1::REFUSAL_REASON_WRONG_INSTANCE:
      return absl::StatusCode::kNotFound;
    case v1::REFUSAL_REASON_EXPIRED_TOKEN:
      return absl::StatusCode::kDeadlineExceeded;
    case v1::REFUSAL_REASON_UNKNOWN_PLAYER:
      return absl::StatusCode::kPermissionDenied;
    case v1::REFUSAL_REASON_FULL:
      return absl::StatusCode::kResourceExhausted;
    default:
      return absl::StatusCode::kFailedPrecondition;
  }
}

}  // namespace

Client::Impl::Impl(const JoinOptions& options_in, Session session_in, std::unique_ptr<net::Endpoint> endpoint_in)
    : options(options_in),
      session(std::move(session_in)),
      endpoint(std::move(endpoint_in)),
      world(session.tick_rate_hz, SnapshotTicks(session)),
      playout(session.tick_rate_hz, session.snapshot_rate_hz) {
  for (const RegionEndpoint& region : session.regions) {
    links.emplace_back(region, session.scene->bounds, replication::Settings());
  }
}

absl::StatusOr<std::unique_ptr<Client>> Client::Join(const JoinOptions& options) {
  absl::StatusOr<Session> session =
      JoinInstance(options.control_address, options.instance_id, options.player_name, options.deadline);
  if (!session.ok()) return session.status();
  // Twice: a region that comes back takes a new peer while the old one fades.
  auto endpoint =
      net::Endpoint::Create({.bind_address = options.bind_address, .max_peers = 2 * session->regions.size() + 2});
  if (!endpoint.ok()) {
    (void)LeaveInstance(options.control_address, options.instance_id, session->credentials.token, options.deadline);
    return endpoint.status();
  }
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Impl>(options, *std::move(session), *std::move(endpoint))));
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;

std::vector<ClientEvent> Client::Poll(TimePoint now) {
  Impl& me = *impl_;
  if (me.state == ClientState::kEnded) return std::exchange(me.events, {});
  const TimePoint begin = Clock::now();
  if (me.last_poll.has_value()) me.frame_time.Add(now - *me.last_poll);
  me.last_poll = now;
  me.Receive(now);
  if (me.state != ClientState::kEnded) {
    me.world.Expire(now, me.events);
    me.CheckProgress(now);
  }
  if (me.state != ClientState::kEnded) {
    for (RegionLink& link : me.links) link.DialIfDue(now, *me.endpoint, me.session.credentials);
    me.MakeInputs(now);
    me.SendInputs();
  }
  me.endpoint->Flush();
  me.MeasureRates(now);
  me.network_time.Add(Clock::now() - begin);
  return std::exchange(me.events, {});
}

void Client::Impl::Receive(TimePoint now) {
  for (const net::Event& event : endpoint->Service(std::chrono::milliseconds(0))) {
    RegionLink* link = LinkOf(event.peer);
    if (link == nullptr) continue;  // let go of earlier in this very batch
    switch (event.kind) {
      case net::Event::Kind::kConnected:
        link->LetIn();
        break;
      case net::Event::Kind::kDisconnected:
        if (event.refusal) {
          OnDoorRefusal(now, *link, *event.refusal);
        } else {
          OnDisconnected(now, *link);
        }
        break;
      case net::Event::Kind::kMessage:
        bytes_in += event.bytes.size();
        if (event.delivery == net::Delivery::kReliable) {
          OnControl(now, *link, event.bytes);
        } else {
          OnSnapshot(now, *link, event.bytes);
        }
        break;
    }
    if (state == ClientState::kEnded) return;
  }
}

RegionLink* Client::Impl::LinkOf(net::PeerHandle peer) {
  const auto found = std::find_if(links.begin(), links.end(), [&](const RegionLink& l) { return l.peer() == peer; });
  return found == links.end() ? nullptr : &*found;
}

bool Client::Impl::AllWelcomed() const {
  return std::all_of(links.begin(), links.end(), [](const RegionLink& link) { return link.welcomed(); });
}

void Client::Impl::OnDisconnected(TimePoint now, RegionLink& link) {
  const bool lost = link.welcomed();
  link.Disconnected(now);
  if (!lost) return;
  world.RegionLost(link.region());
  events.push_back({.kind = ClientEvent::Kind::kRegionLost, .region = link.region()});
}

void Client::Impl::OnControl(TimePoint now, RegionLink& link, const net::Bytes& bytes) {
  v1::RegionControl control;
  if (!control.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return link.CountError();
  switch (control.kind_case()) {
    case v1::RegionControl::kWelcome:
      return OnWelcome(now, link, control.welcome());
    case v1::RegionControl::kRefusal:
      return OnRefusal(link, control.refusal());
    case v1::RegionControl::kStarted:
      return Start();
    case v1::RegionControl::kMap:
      return AdoptMap(link, control.map().map());
    case v1::RegionControl::kInputRefused: {
      const v1::InputRefused& refused = control.input_refused();
      ++inputs_refused;
      events.push_back({.kind = ClientEvent::Kind::kInputRefused,
                        .body = BodyId(refused.body()),
                        .region = link.region(),
                        .input_number = refused.input_number(),
                        .detail = refused.detail()});
      return;
    }
    case v1::RegionControl::kStopping:
      return OnStopping(link, control.stopping().reason());
    case v1::RegionControl::kPass:
      return OnPass(link, control.pass());
    case v1::RegionControl::kPairEvents:
      return;
    case v1::RegionControl::KIND_NOT_SET:
      return link.CountError();
  }
}

void Client::Impl::OnWelcome(TimePoint now, RegionLink& link, const v1::RegionWelcome& welcome) {
  if (link.state() != RegionLink::State::kGreeted) return link.CountError();
  if (welcome.region() != link.region().value() || welcome.player() != session.player.value()) {
    return End(absl::InternalError(absl::StrCat(link.Where(), " answers as region ", welcome.region(), " to player ",
                                                welcome.player())),
               "");
  }
  const bool again = state != ClientState::kJoining;
  link.Welcomed();
  world.RegionBegins(now, link.region());
  if (again) events.push_back({.kind = ClientEvent::Kind::kRegionBack, .region = link.region()});
  AdoptMap(link, welcome.map());
  if (state == ClientState::kJoining && AllWelcomed()) state = ClientState::kWaiting;
  if (welcome.started() || started) Start();
}

void Client::Impl::Start() {
  if (!started) {
    started = true;
    events.push_back({.kind = ClientEvent::Kind::kStarted});
  }
  if (state == ClientState::kWaiting) state = ClientState::kPlaying;
}

void Client::Impl::OnRefusal(RegionLink& link, const v1::RegionRefusal& refusal) {
  if (refusal.reason() == v1::REFUSAL_REASON_STOPPING) return OnStopping(link, refusal.detail());
  const absl::string_view word = absl::StripPrefix(v1::RefusalReason_Name(refusal.reason()), "REFUSAL_REASON_");
  End(absl::Status(CodeOf(refusal.reason()), absl::StrCat(link.Where(), " refuses: ", word, ": ", refusal.detail())),
      "");
}

// Once in the world, a door that is another's by now or has no room is tried again: a region may be on its way to
// another address, and the map tells where.
void Client::Impl::OnDoorRefusal(TimePoint now, RegionLink& link, const net::Refusal& refusal) {
  const bool for_good = refusal.reason == net::Refused::kProtocol || refusal.reason == net::Refused::kExpired ||
                        refusal.reason == net::Refused::kStopping;
  if (state == ClientState::kJoining || for_good) return OnRefusal(link, ToProto(refusal));
  link.Failed(refusal.detail);
  OnDisconnected(now, link);
}

void Client::Impl::OnPass(RegionLink& link, const v1::RegionPass& pass) {
  const absl::StatusOr<net::SessionKey> key = net::SessionKeyFrom(pass.session_key());
  const std::string& token = pass.connect_token();
  if (!key.ok() || token.size() > net::kMaxTokenBytes) return link.CountError();
  session.credentials = {.token = {token.begin(), token.end()}, .key = *key};
}

void Client::Impl::OnStopping(RegionLink& link, const std::string& why) {
  link.Stop(*endpoint);
  world.RegionLost(link.region());
  const bool all = std::all_of(links.begin(), links.end(),
                               [](const RegionLink& l) { return l.state() == RegionLink::State::kStopped; });
  if (all) End(absl::OkStatus(), absl::StrCat("the instance ends: ", why));
}

void Client::Impl::OnSnapshot(TimePoint now, RegionLink& link, const net::Bytes& bytes) {
  const std::optional<replication::ReceivedSnapshot> snapshot = link.ReadSnapshot(bytes);
  if (!snapshot.has_value()) return;
  full_records += snapshot->full_records;
  delta_records += snapshot->bodies.size() - snapshot->full_records;
  newest_tick = std::max(newest_tick, snapshot->tick);
  last_applied_input = std::max(last_applied_input, snapshot->last_input);
  playout.Arrived(now, snapshot->tick);
  world.Take(now, link.region(), *snapshot, events);
  if (link.AcknowledgementUrgent()) Sent(link.Send(*endpoint, {}));
}

void Client::Impl::AdoptMap(RegionLink& from, const v1::PartitionMap& proto) {
  if (proto.version() <= session.map.version().value()) return;
  absl::StatusOr<PartitionMap> map = FromProto(proto);
  if (!map.ok()) return from.CountError();
  session.map = *std::move(map);
  // A region that the map no longer names is not dialled again.
  for (RegionLink& link : links) {
    const auto regions = session.map.regions();
    const bool named =
        std::any_of(regions.begin(), regions.end(), [&](const MapRegion& r) { return r.id == link.region(); });
    if (!named && link.state() == RegionLink::State::kIdle) link.Stop(*endpoint);
  }
  events.push_back({.kind = ClientEvent::Kind::kMapChanged});
}

void Client::Impl::CheckProgress(TimePoint now) {
  if (!joined_by.has_value()) joined_by = now + options.deadline;
  if (state == ClientState::kJoining && now >= *joined_by) {
    const auto mute = std::find_if(links.begin(), links.end(), [](const RegionLink& l) { return !l.welcomed(); });
    const std::string error = mute->last_error().empty() ? "" : absl::StrCat(": ", mute->last_error());
    return End(absl::DeadlineExceededError(absl::StrCat(mute->Where(), " does not answer", error)), "");
  }
  if (std::any_of(links.begin(), links.end(), [](const RegionLink& l) { return l.welcomed(); })) {
    silent_since.reset();
    return;
  }
  if (!silent_since.has_value()) silent_since = now;
  if (now - *silent_since >= kMaxSilence && state != ClientState::kJoining) {
    End(absl::UnavailableError(absl::StrCat("instance ", options.instance_id, ": no region answers any more")), "");
  }
}

void Client::Impl::End(absl::Status why, std::string detail) {
  if (state == ClientState::kEnded) return;
  state = ClientState::kEnded;
  reason = std::move(why);
  if (detail.empty()) detail = std::string(reason.message());
  for (RegionLink& link : links) link.Stop(*endpoint);
  events.push_back({.kind = ClientEvent::Kind::kEnded, .detail = std::move(detail)});
}

void Client::Impl::MeasureRates(TimePoint now) {
  if (!traffic.empty() && now - traffic.back().time < kTrafficStep) return;
  traffic.push_back({now, bytes_in, bytes_out});
  while (now - traffic.front().time > kTrafficWindow) traffic.pop_front();
}

std::vector<ShownBody> Client::Interpolated(TimePoint now) {
  const TimePoint begin = Clock::now();
  const double tick = impl_->playout.Advance(now);
  std::vector<ShownBody> shown = impl_->world.At(tick, impl_->session.tick_rate_hz);
  impl_->update_time.Add(Clock::now() - begin);
  return shown;
}

absl::Status Client::Leave(std::chrono::milliseconds deadline) {
  const absl::Status status = LeaveInstance(impl_->options.control_address, impl_->options.instance_id,
                                            impl_->session.credentials.token, deadline);
  impl_->End(absl::OkStatus(), "left");
  impl_->endpoint->Flush();
  return status;
}

ClientState Client::state() const { return impl_->state; }
absl::Status Client::reason() const { return impl_->reason; }
PlayerNumber Client::player() const { return impl_->session.player; }
BodyId Client::own_body() const { return PlayerBodyId(impl_->session.player); }
const Scene& Client::scene() const { return *impl_->session.scene; }
const PartitionMap& Client::map() const { return impl_->session.map; }
Tick Client::tick() const { return impl_->newest_tick; }
std::uint32_t Client::last_applied_input() const { return impl_->last_applied_input; }
const std::map<BodyId, SeenBody>& Client::World() const { return impl_->world.bodies(); }

ClientStats Client::Stats() const {
  const Impl& me = *impl_;
  ClientStats stats;
  stats.bytes_in = me.bytes_in;
  stats.bytes_out = me.bytes_out;
  if (me.traffic.size() > 1) {
    const double span_s = std::chrono::duration<double>(me.traffic.back().time - me.traffic.front().time).count();
    stats.bytes_in_per_s = static_cast<double>(me.traffic.back().in - me.traffic.front().in) / span_s;
    stats.bytes_out_per_s = static_cast<double>(me.traffic.back().out - me.traffic.front().out) / span_s;
  }
  for (const RegionLink& link : me.links) {
    stats.regions.push_back(link.Stats(*me.endpoint));
    stats.datagrams_lost += stats.regions.back().datagrams_lost;
    stats.decode_errors += stats.regions.back().decode_errors;
    const bool own = me.world.OwnerOf(PlayerBodyId(me.session.player)) == link.region();
    if (link.welcomed() && (own || stats.round_trip_s == 0)) stats.round_trip_s = stats.regions.back().round_trip_s;
  }
  stats.full_records = me.full_records;
  stats.delta_records = me.delta_records;
  stats.inputs_refused = me.inputs_refused;
  stats.bodies = me.world.bodies().size();
  stats.tick_rate_hz = me.playout.tick_rate_hz();
  stats.snapshot_delay_s = me.playout.delay_s();
  stats.jitter_s = me.playout.jitter_s();
  stats.extrapolations = me.world.extrapolations();
  stats.playout_jumps = me.playout.jumps();
  stats.frame_time = me.frame_time.Summary();
  stats.network_time = me.network_time.Summary();
  stats.update_time = me.update_time.Summary();
  return stats;
}

}  // namespace tessera::client
