// What a client is told, and what comes of it.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client_sdk/client_impl.h"

namespace tessera::client {
namespace {

// The acceptor and the region behind it refuse by one list of reasons.
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

void Client::Impl::Receive(TimePoint now) {
  for (const net::Event& event : wire.Service(now)) {
    RegionLink* link = LinkOf(event.peer);
    if (link == nullptr) continue;  // let go of earlier in this very batch
    OnEvent(now, *link, event);
    if (state == ClientState::kEnded) return;
  }
}

void Client::Impl::OnEvent(TimePoint now, RegionLink& link, const net::Event& event) {
  switch (event.kind) {
    case net::Event::Kind::kConnected:
      return link.LetIn(event.peer);
    case net::Event::Kind::kDisconnected:
      return event.refusal ? OnDialRefused(now, link, *event.refusal) : OnDisconnected(now, link);
    case net::Event::Kind::kMessage:
      bytes_in += event.bytes.size();
      return event.delivery == net::Delivery::kReliable ? OnControl(now, link, event.bytes)
                                                        : OnSnapshot(now, link, event.bytes);
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
  RegionChanged(now, link.region(), RegionEntry::Change::kLost);
  events.push_back({.kind = ClientEvent::Kind::kRegionLost, .region = link.region()});
}

void Client::Impl::OnControl(TimePoint now, RegionLink& link, const net::Bytes& bytes) {
  v1::RegionControl control;
  if (!control.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return link.CountError();
  switch (control.kind_case()) {
    case v1::RegionControl::kWelcome:
      return OnWelcome(now, link, control.welcome());
    case v1::RegionControl::kRefusal:
      return OnRefusal(now, link, control.refusal());
    case v1::RegionControl::kStarted:
      return Start();
    case v1::RegionControl::kMap:
      AdoptEndpoints(link, control.map().endpoints());
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
      return OnStopping(now, link, control.stopping().reason());
    case v1::RegionControl::kRenewedToken:
      return OnRenewedToken(link, control.renewed_token());
    case v1::RegionControl::kPairEvents:
      return OnPairEvents(now, link, control.pair_events());
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
  RegionChanged(now, link.region(), RegionEntry::Change::kBegins);
  if (again) events.push_back({.kind = ClientEvent::Kind::kRegionBack, .region = link.region()});
  AdoptEndpoints(link, welcome.endpoints());
  AdoptMap(link, welcome.map());
  if (welcome.started()) Start();
}

void Client::Impl::Start() {
  if (started) return;
  started = true;
  follow_due = true;  // until then every region wants to hear of every player
  events.push_back({.kind = ClientEvent::Kind::kStarted});
}

void Client::Impl::OnRefusal(TimePoint now, RegionLink& link, const v1::RegionRefusal& refusal) {
  if (refusal.reason() == v1::REFUSAL_REASON_STOPPING) return OnStopping(now, link, refusal.detail());
  const absl::string_view word = absl::StripPrefix(v1::RefusalReason_Name(refusal.reason()), "REFUSAL_REASON_");
  End(absl::Status(CodeOf(refusal.reason()), absl::StrCat(link.Where(), " refuses: ", word, ": ", refusal.detail())),
      "");
}

// Once in the world, a door that is another's by now or has no room is tried again: a region may be on its way to
// another address, and the map tells where.
void Client::Impl::OnDialRefused(TimePoint now, RegionLink& link, const net::Refusal& refusal) {
  const bool for_good = refusal.reason == net::Refused::kProtocol || refusal.reason == net::Refused::kExpired ||
                        refusal.reason == net::Refused::kStopping;
  if (state == ClientState::kJoining || for_good) return OnRefusal(now, link, ToProto(refusal));
  link.Failed(refusal.detail);
  OnDisconnected(now, link);
}

void Client::Impl::OnPairEvents(TimePoint now, RegionLink& link, const v1::PairEvents& told) {
  const Tick tick(told.tick());
  std::vector<BodyPair> whole;
  for (const v1::PairEvent& event : told.events()) {
    const BodyPair pair{BodyId(event.body_a()), BodyId(event.body_b()), event.trigger()};
    if (pair.a >= pair.b || (told.whole() && !event.begin())) return link.CountError();
    if (told.whole()) {
      whole.push_back(pair);
    } else {
      pairs.Told(now, link.region(), tick, pair, event.begin());
    }
  }
  if (!told.whole()) return;
  pairs.ToldAll(now, link.region(), tick, whole, [&](const BodyPair& pair) {
    const std::optional<RegionId> owner = world.OwnerOf(IsStatic(pair.a) ? pair.b : pair.a);
    return owner.has_value() && *owner != link.region();
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

void Client::Impl::OnRenewedToken(RegionLink& link, const v1::RenewedToken& renewed) {
  const absl::StatusOr<net::SessionKey> key = net::SessionKeyFrom(renewed.session_key());
  const std::string& token = renewed.connect_token();
  if (!key.ok() || token.size() > net::kMaxTokenBytes) return link.CountError();
  session.credentials = {.token = {token.begin(), token.end()}, .key = *key};
}

void Client::Impl::OnStopping(TimePoint now, RegionLink& link, const std::string& why) {
  link.Stop(wire);
  RegionChanged(now, link.region(), RegionEntry::Change::kLost);
  const auto stopped = [](const RegionLink& l) { return l.state() == RegionLink::State::kStopped; };
  if (!std::all_of(links.begin(), links.end(), stopped)) return;
  // The map may name others: some that have come in the place of these, and were heard of in the same breath; some that
  // are too far away to have been listened to. They are asked.
  bool any_new = false, any_near = false;
  for (const MapRegion& region : session.map.regions()) {
    const auto is_it = [&](const RegionLink& l) { return l.region() == region.id; };
    if (std::any_of(links.begin(), links.end(), is_it)) continue;
    any_new = true;
    any_near = any_near || Near(region.id, 0);
  }
  if (!any_new) return End(absl::OkStatus(), absl::StrCat("the instance ends: ", why));
  searching = searching || !any_near;
  follow_due = true;
}

void Client::Impl::OnSnapshot(TimePoint now, RegionLink& link, const net::Bytes& bytes) {
  const std::optional<replication::ReceivedSnapshot> snapshot = link.ReadSnapshot(bytes);
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
  if (recorder) recorder->Snapshot(now, link.region(), *snapshot);
  world.Take(now, link.region(), *snapshot, events);
  NoteApplied(now, link, *snapshot);
  if (link.AcknowledgementUrgent()) Sent(link.Send(now, wire, {}));
}

}  // namespace tessera::client
