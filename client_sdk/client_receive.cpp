// Receiving: connections, control messages and snapshots of the regions.
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client_sdk/client_impl.h"
#include "core/replication/datagram.h"
#include "core/world/proto_math.h"

namespace tessera::client {
namespace {

// The acceptor and the region behind it refuse by one list of reasons.
static_assert(v1::REFUSAL_REASON_PROTOCOL == static_cast<int>(net::Refused::kProtocol));
static_assert(v1::REFUSAL_REASON_BAD_CREDENTIAL == static_cast<int>(net::Refused::kBadCredential));
static_assert(v1::REFUSAL_REASON_WRONG_INSTANCE == static_cast<int>(net::Refused::kWrongInstance));
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
    case v1::REFUSAL_REASON_BAD_CREDENTIAL:
      return absl::StatusCode::kUnauthenticated;
    case v1::REFUSAL_REASON_WRONG_INSTANCE:
      return absl::StatusCode::kNotFound;
    case v1::REFUSAL_REASON_UNKNOWN_PLAYER:
      return absl::StatusCode::kPermissionDenied;
    case v1::REFUSAL_REASON_FULL:
      return absl::StatusCode::kResourceExhausted;
    default:
      return absl::StatusCode::kFailedPrecondition;
  }
}

// Nothing where the region says nothing, or nothing that makes sense.
std::optional<MeetingPoint> MeetingPointOf(const v1::PairEvent& event) {
  if (!event.has_contact()) return std::nullopt;
  const v1::PairContact& contact = event.contact();
  const MeetingPoint met{FromProto(contact.point()), Vec3f(FromProto(contact.normal())),
                         static_cast<float>(contact.impulse())};
  const bool finite = IsFinite(met.point) && IsFinite(Vec3d(met.normal)) && std::isfinite(met.impulse);
  return finite ? std::optional(met) : std::nullopt;
}

}  // namespace

void Client::Impl::Receive(TimePoint now) {
  for (const net::Event& event : network.Service(now)) {
    RegionConnection* connection = ConnectionOf(event.peer);
    if (connection == nullptr) continue;  // dropped earlier in this very batch
    OnEvent(now, *connection, event);
    if (state == ClientState::kEnded) return;
  }
}

void Client::Impl::OnEvent(TimePoint now, RegionConnection& connection, const net::Event& event) {
  switch (event.kind) {
    case net::Event::Kind::kConnected:
      return connection.Accepted(event.peer);
    case net::Event::Kind::kDisconnected:
      return event.refusal ? OnDialRefused(now, connection, *event.refusal) : OnDisconnected(now, connection);
    case net::Event::Kind::kFloods:
      return;  // of accepted peers alone
    case net::Event::Kind::kMessage:
      bytes_in += event.bytes.size();
      return event.delivery == net::Delivery::kReliable ? OnControl(now, connection, event.bytes)
                                                        : OnSnapshot(now, connection, event.bytes);
  }
}

RegionConnection* Client::Impl::ConnectionOf(net::PeerHandle peer) {
  const auto found =
      std::find_if(connections.begin(), connections.end(), [&](const RegionConnection& l) { return l.peer() == peer; });
  return found == connections.end() ? nullptr : &*found;
}

bool Client::Impl::AllWelcomed() const {
  return std::all_of(connections.begin(), connections.end(),
                     [](const RegionConnection& connection) { return connection.welcomed(); });
}

void Client::Impl::OnDisconnected(TimePoint now, RegionConnection& connection) {
  const bool lost = connection.welcomed();
  connection.Disconnected(now);
  if (!lost) return;
  RegionChanged(now, connection.region(), RegionEntry::Change::kLost);
  lost_regions.insert(connection.region());
  events.push_back({.kind = ClientEvent::Kind::kRegionLost, .region = connection.region()});
}

void Client::Impl::OnControl(TimePoint now, RegionConnection& connection, const net::Bytes& bytes) {
  v1::RegionControl control;
  if (!control.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return connection.CountError();
  switch (control.kind_case()) {
    case v1::RegionControl::kWelcome:
      return OnWelcome(now, connection, control.welcome());
    case v1::RegionControl::kRefusal:
      return OnRefusal(now, connection, control.refusal());
    case v1::RegionControl::kStarted:
      return Start();
    case v1::RegionControl::kMap:
      AdoptEndpoints(connection, control.map().endpoints());
      return AdoptMap(connection, control.map().map());
    case v1::RegionControl::kInputRefused: {
      const v1::InputRefused& refused = control.input_refused();
      ++inputs_refused;
      events.push_back({.kind = ClientEvent::Kind::kInputRefused,
                        .body = BodyId(refused.body()),
                        .region = connection.region(),
                        .input_number = refused.input_number(),
                        .detail = refused.detail()});
      return;
    }
    case v1::RegionControl::kStopping:
      return OnStopping(now, connection, control.stopping().reason());
    case v1::RegionControl::kPairEvents:
      return OnPairEvents(now, connection, control.pair_events());
    case v1::RegionControl::kClock:
      return OnClock(now, connection, control.clock());
    case v1::RegionControl::kPlayerNews:
      return OnPlayerNews(connection, control.player_news());
    case v1::RegionControl::kSessionEnded:
      return OnSessionEnded(control.session_ended().reason());
    case v1::RegionControl::kCommandRefused:
      return OnCommandRefused(connection, control.command_refused());
    case v1::RegionControl::KIND_NOT_SET:
      return connection.CountError();
  }
}

void Client::Impl::OnWelcome(TimePoint now, RegionConnection& connection, const v1::RegionWelcome& welcome) {
  if (connection.state() != RegionConnection::State::kAccepted) return connection.CountError();
  if (welcome.region() != connection.region().value() || welcome.player() != session.player.value()) {
    return End(absl::InternalError(absl::StrCat(connection.Where(), " answers as region ", welcome.region(),
                                                " to player ", welcome.player())),
               "");
  }
  connection.Welcomed();
  RegionChanged(now, connection.region(), RegionEntry::Change::kBegins);
  // One that is dialled for the first time, or at another address, was never lost.
  if (lost_regions.erase(connection.region()) > 0)
    events.push_back({.kind = ClientEvent::Kind::kRegionBack, .region = connection.region()});
  AdoptEndpoints(connection, welcome.endpoints());
  AdoptMap(connection, welcome.map());
  if (welcome.has_clock()) OnClock(now, connection, welcome.clock());
  if (welcome.started()) Start();
}

// Every region reports a change, at the same tick; a report from before another one counts no more.
void Client::Impl::OnClock(TimePoint now, RegionConnection& connection, const v1::WorldClock& message) {
  const double pace = message.ticks_per_second();
  if (!(pace > 0 && pace <= session.tick_rate_hz)) return connection.CountError();
  if (message.tick() < clock_tick) return;
  clock_tick = message.tick();
  const WorldClock changed{.paused = message.paused(), .ticks_per_second = pace};
  if (changed == clock) return;
  clock = changed;
  playout.SetPace(now, pace, clock.paused);
  events.push_back({.kind = ClientEvent::Kind::kClockChanged});
}

void Client::Impl::Start() {
  if (started) return;
  started = true;
  follow_due = true;  // until then the client is connected to every region
  events.push_back({.kind = ClientEvent::Kind::kStarted});
}

// In the game's own words, which the player is to read.
void Client::Impl::OnSessionEnded(const std::string& why) { End(absl::AbortedError(why), why); }

void Client::Impl::OnRefusal(TimePoint now, RegionConnection& connection, const v1::RegionRefusal& refusal) {
  if (refusal.reason() == v1::REFUSAL_REASON_STOPPING) return OnStopping(now, connection, refusal.detail());
  if (refusal.reason() == v1::REFUSAL_REASON_SESSION_ENDED) return OnSessionEnded(refusal.detail());
  if (refusal.reason() == v1::REFUSAL_REASON_REPLACED) {
    return End(absl::AlreadyExistsError("another process joined as this player"), "");
  }
  const absl::string_view reason_name = absl::StripPrefix(v1::RefusalReason_Name(refusal.reason()), "REFUSAL_REASON_");
  End(absl::Status(CodeOf(refusal.reason()),
                   absl::StrCat(connection.Where(), " refuses: ", reason_name, ": ", refusal.detail())),
      "");
}

// Once in the world, a client dials again when another region answers at an address, or the region is full: it may be
// moving to another address, which the map will give.
void Client::Impl::OnDialRefused(TimePoint now, RegionConnection& connection, const net::Refusal& refusal) {
  const bool for_good = refusal.reason == net::Refused::kProtocol || refusal.reason == net::Refused::kStopping;
  if (state == ClientState::kJoining || for_good) return OnRefusal(now, connection, ToProto(refusal));
  connection.Failed(refusal.detail);
  OnDisconnected(now, connection);
}

void Client::Impl::OnPairEvents(TimePoint now, RegionConnection& connection, const v1::PairEvents& message) {
  const Tick tick(message.tick());
  std::vector<BodyPair> whole;
  for (const v1::PairEvent& event : message.events()) {
    const BodyPair pair{BodyId(event.body_a()), BodyId(event.body_b()), event.trigger()};
    if (pair.a >= pair.b || (message.whole() && !event.begin())) return connection.CountError();
    if (message.whole()) {
      whole.push_back(pair);
    } else {
      pairs.Take(now, connection.region(), tick, pair, event.begin(), MeetingPointOf(event));
    }
  }
  if (!message.whole()) return;
  pairs.TakeAll(now, connection.region(), tick, whole, [&](const BodyPair& pair) {
    const std::optional<RegionId> owner = world.OwnerOf(IsStatic(pair.a) ? pair.b : pair.a);
    return owner.has_value() && *owner != connection.region();
  });
}

bool Client::Impl::IsStatic(BodyId body) const {
  const std::vector<BodyDef>& bodies = session.scene->bodies;
  const auto found =
      std::lower_bound(bodies.begin(), bodies.end(), body, [](const BodyDef& def, BodyId id) { return def.id < id; });
  return found != bodies.end() && found->id == body && found->motion != Motion::kDynamic;
}

void Client::Impl::SettlePairs(TimePoint now) {
  pairs.Settle(
      now, [&](BodyId body) { return world.bodies().contains(body) || IsStatic(body); }, events);
}

void Client::Impl::OnStopping(TimePoint now, RegionConnection& connection, const std::string& why) {
  connection.Stop(network);
  RegionChanged(now, connection.region(), RegionEntry::Change::kLost);
  const auto stopped = [](const RegionConnection& l) { return l.state() == RegionConnection::State::kStopped; };
  if (!std::all_of(connections.begin(), connections.end(), stopped)) return;
  // The map may name other regions: some that replace these, and some that were too far away to connect to. They are
  // dialled.
  bool any_new = false, any_near = false;
  for (const MapRegion& region : session.map.regions()) {
    const auto is_it = [&](const RegionConnection& l) { return l.region() == region.id; };
    if (std::any_of(connections.begin(), connections.end(), is_it)) continue;
    any_new = true;
    any_near = any_near || Near(region.id, 0);
  }
  if (!any_new) return End(absl::OkStatus(), absl::StrCat("the instance ends: ", why));
  searching = searching || !any_near;
  follow_due = true;
}

void Client::Impl::OnSnapshot(TimePoint now, RegionConnection& connection, const net::Bytes& bytes) {
  if (replication::KindOf(bytes) == replication::DatagramKind::kRegionFigures) return connection.TakeFigures(bytes);
  const std::optional<replication::ReceivedSnapshot> snapshot = connection.ReadSnapshot(bytes);
  if (!snapshot.has_value()) return;
  full_records += snapshot->full_records;
  delta_records += snapshot->bodies.size() - snapshot->full_records;
  newest_tick = std::max(newest_tick, snapshot->tick);
  last_applied_input = std::max(last_applied_input, snapshot->last_input);
  if (snapshot->last_input >= next_input) {  // made by an earlier client of this player: ours would pass for late
    next_input = snapshot->last_input + 1;
    inputs.Clear();
    input_clock.Stop();
  }
  playout.Arrived(now, snapshot->tick);
  if (recorder) recorder->Snapshot(now, connection.region(), *snapshot);
  world.Take(now, connection.region(), *snapshot, events);
  NoteApplied(now, connection, *snapshot);
  if (connection.AcknowledgementUrgent()) Sent(connection.Send(now, network, {}));
}

}  // namespace tessera::client
