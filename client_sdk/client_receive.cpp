// Receiving: connections, control messages and snapshots of the regions.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"
#include "core/replication/datagram.h"
#include "core/replication/movement_news.h"
#include "core/replication/record_codec.h"

namespace tessera::client {
namespace {

using replication::RefusalReason;

// The acceptor and the region behind it refuse by one list of reasons.
template <net::Refused kByAcceptor, RefusalReason kByRegion>
inline constexpr bool kSameReason = static_cast<std::uint32_t>(kByAcceptor) == static_cast<std::uint32_t>(kByRegion);
static_assert(kSameReason<net::Refused::kProtocol, RefusalReason::kProtocol>);
static_assert(kSameReason<net::Refused::kBadCredential, RefusalReason::kBadCredential>);
static_assert(kSameReason<net::Refused::kWrongInstance, RefusalReason::kWrongInstance>);
static_assert(kSameReason<net::Refused::kFull, RefusalReason::kFull>);
static_assert(kSameReason<net::Refused::kStopping, RefusalReason::kStopping>);
static_assert(kSameReason<net::Refused::kWrongRegion, RefusalReason::kWrongRegion>);

absl::StatusCode CodeOf(RefusalReason reason) {
  switch (reason) {
    case RefusalReason::kBadCredential:
      return absl::StatusCode::kUnauthenticated;
    case RefusalReason::kWrongInstance:
      return absl::StatusCode::kNotFound;
    case RefusalReason::kUnknownPlayer:
      return absl::StatusCode::kPermissionDenied;
    case RefusalReason::kFull:
      return absl::StatusCode::kResourceExhausted;
    default:
      return absl::StatusCode::kFailedPrecondition;
  }
}

// Snapshots of one region that a poll reads at most: of those that came together the newest. A poll that was late reads
// fewer: nobody has seen the frames between, and what a late poll costs makes the next one late.
constexpr std::int64_t kSnapshotsAPoll = 4, kSnapshotsALatePoll = 1;
// A program that shows fewer frames a second than this stands, rather than plays.
constexpr std::chrono::milliseconds kLatePoll{100};
// Units (WorkBudget) for receiving a datagram, for reading a snapshot's, and for each body in it.
constexpr std::int64_t kUnitsToReceive = 150, kUnitsToRead = 50, kUnitsToTakeABody = 30;

bool IsDatagram(const net::Event& event) {
  return event.kind == net::Event::Kind::kMessage && event.delivery == net::Delivery::kUnsequenced;
}

std::optional<Tick> TickOfSnapshot(const net::Event& event) {
  if (!IsDatagram(event) || replication::KindOf(event.bytes) != replication::DatagramKind::kSnapshot)
    return std::nullopt;
  replication::SnapshotHeader header;
  replication::BitReader reader(event.bytes);
  if (!replication::ReadHeader(reader, header).ok() || !reader.ok())
    return std::nullopt;  // it is refused as it is read
  return header.tick;
}

// The snapshots of a peer that are worth reading, by their ticks. An older one is passed over, which is as good as
// lost: it is not acknowledged, and what it alone would have said comes with a later one. A newer one is kept for the
// next poll.
struct WorthReading {
  Tick oldest, newest;
};

// The newest of those that arrived together, over so many ticks. A single one is to be complete: else bodies whose
// records come last, as players' do after those of a scene, would be missing time and again. If it has fewer datagrams
// than another one, some may be on their way, or wait for the next poll, or have not fit into the socket's buffer.
std::map<net::PeerHandle, WorthReading> FindWorthReading(const std::vector<net::Event>& arrived, std::int64_t ticks) {
  std::map<net::PeerHandle, std::map<Tick, std::size_t>> datagrams;
  for (const net::Event& event : arrived) {
    if (const auto tick = TickOfSnapshot(event)) ++datagrams[event.peer][*tick];
  }
  std::map<net::PeerHandle, WorthReading> worth;
  for (const auto& [peer, counts] : datagrams) {
    auto last = std::prev(counts.end());
    const auto has_more = [&](const auto& other) { return other.second > last->second; };
    if (ticks == 0 && std::ranges::any_of(counts, has_more)) --last;
    const std::uint64_t newest = last->first.value();
    worth[peer] = {Tick(newest - std::min<std::uint64_t>(newest, ticks)), last->first};
  }
  return worth;
}

// Whether no region owns the body, so none sends it.
bool IsStatic(const Scene& scene, bool has_tiles, BodyId body) {
  const std::vector<BodyDef>& bodies = scene.bodies;
  const auto found =
      std::lower_bound(bodies.begin(), bodies.end(), body, [](const BodyDef& def, BodyId id) { return def.id < id; });
  if (found != bodies.end() && found->id == body) return found->motion != Motion::kDynamic;
  // One that the scene does not have is in a tile, be it here or not.
  return has_tiles && body != BodyId() && !IsPlayerBody(body) && !IsSpawned(body);
}

// Nothing where the region says nothing, or nothing that makes sense.
std::optional<MeetingPoint> MeetingPointOf(const replication::PairChange& change) {
  if (!change.contact) return std::nullopt;
  const MeetingPoint met{change.contact->point, Vec3f(change.contact->normal),
                         static_cast<float>(change.contact->impulse)};
  const bool finite = IsFinite(met.point) && IsFinite(Vec3d(met.normal)) && std::isfinite(met.impulse);
  return finite ? std::optional(met) : std::nullopt;
}

}  // namespace

void Client::Impl::Receive(TimePoint now) {
  std::vector<net::Event> arrived = network.Service(now);
  const bool late = since_last_poll > kLatePoll || std::exchange(behind, false);
  behind = arrived.size() >= kDatagramsAPoll;  // and more waits
  figures.Work(kUnitsToReceive * std::ssize(arrived));
  arrived.insert(arrived.begin(), std::make_move_iterator(kept.begin()), std::make_move_iterator(kept.end()));
  kept.clear();
  const auto interval = static_cast<std::int64_t>(session.tick_rate_hz / session.snapshot_rate_hz);
  const std::map<net::PeerHandle, WorthReading> worth_reading =
      FindWorthReading(arrived, ((late ? kSnapshotsALatePoll : kSnapshotsAPoll) - 1) * interval);
  std::set<net::PeerHandle> keeps;
  for (net::Event& event : arrived) {
    RegionConnection* connection = regions.Of(event.peer);
    if (connection == nullptr) continue;  // dropped earlier in this very batch
    if (const auto tick = TickOfSnapshot(event)) {
      const WorthReading& worth = worth_reading.at(event.peer);
      if (*tick < worth.oldest) {
        connection->PassOver();
        continue;
      }
      if (*tick > worth.newest) keeps.insert(event.peer);
    }
    if (IsDatagram(event) && keeps.contains(event.peer)) {  // with those that belong to it
      kept.push_back(std::move(event));
      continue;
    }
    OnEvent(now, *connection, event);
    if (progress.ended()) return;
  }
}

void Client::Impl::OnEvent(TimePoint now, RegionConnection& connection, const net::Event& event) {
  switch (event.kind) {
    case net::Event::Kind::kConnected:
      return connection.Accepted(event.peer);
    case net::Event::Kind::kDisconnected:
      return event.refusal ? OnDialRefused(now, connection, *event.refusal) : OnDisconnected(now, connection);
    case net::Event::Kind::kFloods:
      return;  // comes from accepted peers alone
    case net::Event::Kind::kMessage:
      figures.Received(event.bytes.size());
      return event.delivery == net::Delivery::kReliable ? OnControl(now, connection, event.bytes)
                                                        : OnSnapshot(now, connection, event.bytes);
  }
}

void Client::Impl::OnDisconnected(TimePoint now, RegionConnection& connection) {
  if (regions.Disconnected(now, connection)) OnLost(now, connection.region());
}

void Client::Impl::OnLost(TimePoint now, RegionId region) {
  RegionChanged(now, region, RegionEntry::Change::kLost);
  events.push_back({.kind = ClientEvent::Kind::kRegionLost, .region = region});
}

void Client::Impl::OnControl(TimePoint now, RegionConnection& connection, const net::Bytes& bytes) {
  if (replication::IsSceneMessage(bytes)) return OnSceneMessage(now, connection, bytes);
  const absl::StatusOr<replication::RegionMessage> message = replication::DecodeRegionMessage(bytes);
  if (!message.ok()) return connection.CountError();
  std::visit([&](const auto& of) { On(now, connection, of); }, *message);
}

void Client::Impl::On(TimePoint, RegionConnection&, const replication::Started&) {
  if (!progress.Start()) return;
  regions.Start();
  events.push_back({.kind = ClientEvent::Kind::kStarted});
}

void Client::Impl::On(TimePoint now, RegionConnection& connection, const replication::MapNews& news) {
  for (std::size_t left = regions.AdoptEndpoints(news.endpoints); left > 0; --left) connection.CountError();
  switch (regions.AdoptMap(news.map)) {
    case ConnectedRegions::News::kMalformed:
      return connection.CountError();
    case ConnectedRegions::News::kOld:
      return;
    case ConnectedRegions::News::kNew:
      recording.Map(now, regions.map());
      events.push_back({.kind = ClientEvent::Kind::kMapChanged});
  }
}

void Client::Impl::On(TimePoint, RegionConnection& connection, const replication::InputRefusal& refusal) {
  figures.InputRefused();
  events.push_back({.kind = ClientEvent::Kind::kInputRefused,
                    .body = BodyId(refusal.body),
                    .region = connection.region(),
                    .input_number = refusal.input_number,
                    .detail = refusal.detail});
}

// In the game's own words, which the player is to read.
void Client::Impl::On(TimePoint, RegionConnection&, const replication::EndOfSession& ended) {
  End(absl::AbortedError(ended.reason), ended.reason);
}

void Client::Impl::On(TimePoint now, RegionConnection& connection, const replication::Welcome& welcome) {
  if (connection.state() != RegionConnection::State::kAccepted) return connection.CountError();
  if (welcome.region != connection.region().value() || welcome.player != own.player().value()) {
    return End(absl::InternalError(absl::StrCat(connection.Where(), " answers as region ", welcome.region,
                                                " to player ", welcome.player)),
               "");
  }
  if (!regions.AnyWelcomed()) time.AfterSilence();
  const bool back = regions.Welcomed(connection);
  RegionChanged(now, connection.region(), RegionEntry::Change::kBegins);
  if (back) events.push_back({.kind = ClientEvent::Kind::kRegionBack, .region = connection.region()});
  On(now, connection, welcome.news);
  if (welcome.clock) On(now, connection, *welcome.clock);
  if (welcome.started) On(now, connection, replication::Started());
}

void Client::Impl::On(TimePoint now, RegionConnection& connection, const replication::ClockNews& news) {
  switch (time.Take(now, news)) {
    case WorldTime::News::kMalformed:
      return connection.CountError();
    case WorldTime::News::kOld:
      return;
    case WorldTime::News::kChanged:
      events.push_back({.kind = ClientEvent::Kind::kClockChanged});
  }
}

void Client::Impl::On(TimePoint now, RegionConnection& connection, const replication::RegionRefusal& refusal) {
  if (refusal.reason == RefusalReason::kStopping)
    return On(now, connection, replication::Stopping{.reason = refusal.detail});
  if (refusal.reason == RefusalReason::kSessionEnded) return End(absl::AbortedError(refusal.detail), refusal.detail);
  if (refusal.reason == RefusalReason::kReplaced) {
    return End(absl::AlreadyExistsError("another process joined as this player"), "");
  }
  End(absl::Status(CodeOf(refusal.reason), absl::StrCat(connection.Where(), " refuses: ",
                                                        replication::NameOf(refusal.reason), ": ", refusal.detail)),
      "");
}

// Once in the world, a client dials again when another region answers at an address, or the region is full: it may be
// moving to another address, which the map will give.
void Client::Impl::OnDialRefused(TimePoint now, RegionConnection& connection, const net::Refusal& refusal) {
  const bool ends = refusal.reason == net::Refused::kStopping && !connection.goes_on();
  const bool for_good = refusal.reason == net::Refused::kProtocol || ends;
  if (progress.state() == ClientState::kJoining || for_good) {
    return On(now, connection, replication::RegionRefusal{static_cast<RefusalReason>(refusal.reason), refusal.detail});
  }
  connection.Failed(refusal.detail);
  OnDisconnected(now, connection);
}

void Client::Impl::On(TimePoint now, RegionConnection& connection, const replication::PairNews& news) {
  const Tick tick(news.tick);
  std::vector<BodyPair> whole;
  for (const replication::PairChange& event : news.events) {
    const BodyPair pair{BodyId(event.body_a), BodyId(event.body_b), event.trigger};
    if (pair.a >= pair.b || (news.whole && !event.begin)) return connection.CountError();
    if (news.whole) {
      whole.push_back(pair);
    } else {
      pairs.Take(now, connection.region(), tick, pair, event.begin, MeetingPointOf(event));
    }
  }
  if (!news.whole) return;
  const bool has_tiles = tiles.store() != nullptr;
  pairs.TakeAll(now, connection.region(), tick, whole, [&](const BodyPair& pair) {
    const std::optional<RegionId> owner = world.OwnerOf(IsStatic(*session.scene, has_tiles, pair.a) ? pair.b : pair.a);
    return owner.has_value() && *owner != connection.region();
  });
}

void Client::Impl::SettlePairs(TimePoint now) {
  const bool has_tiles = tiles.store() != nullptr;
  pairs.Settle(
      now, [&](BodyId body) { return world.bodies().contains(body) || IsStatic(*session.scene, has_tiles, body); },
      events);
}

void Client::Impl::On(TimePoint now, RegionConnection& connection, const replication::Stopping& stopping) {
  if (stopping.goes_on) connection.NoteGoesOn();
  connection.Stop(network);
  RegionChanged(now, connection.region(), RegionEntry::Change::kLost);
  switch (regions.AfterStop(Interest())) {
    case ConnectedRegions::Left::kSome:
    case ConnectedRegions::Left::kOthers:
      return;
    case ConnectedRegions::Left::kSame:
      regions.DialAgain(now, stopping.reason);
      for (const RegionConnection& lost : regions.all()) {
        events.push_back({.kind = ClientEvent::Kind::kRegionLost, .region = lost.region(), .detail = stopping.reason});
      }
      return;
    case ConnectedRegions::Left::kNone:
      return End(absl::OkStatus(), absl::StrCat("the instance ends: ", stopping.reason));
  }
}

// By which function of the game its region moves the own body. Only who owns the body is asked.
void Client::Impl::OnMovement(RegionConnection& connection, const net::Bytes& bytes) {
  if (!connection.welcomed() || delivery.under_way()) return;
  const absl::StatusOr<replication::MovementNews> news = replication::DecodeMovementNews(bytes);
  if (!news.ok()) return connection.CountError();
  if (world.OwnerOf(news->state.body).value_or(connection.region()) != connection.region()) return;
  own.NoteMovedByGame(news->state.body);
  std::string missing = prediction.TakeMovement(*news);
  if (missing.empty()) return;
  events.push_back({.kind = ClientEvent::Kind::kMovementMissing,
                    .body = news->state.body,
                    .region = connection.region(),
                    .detail = std::move(missing)});
}

void Client::Impl::OnSnapshot(TimePoint now, RegionConnection& connection, const net::Bytes& bytes) {
  const replication::DatagramKind kind = replication::KindOf(bytes);
  if (kind == replication::DatagramKind::kRegionFigures) return connection.TakeFigures(bytes);
  if (kind == replication::DatagramKind::kMovement) return OnMovement(connection, bytes);
  if (delivery.under_way()) return;  // nothing says yet how to read it; it is not acknowledged, so it comes again
  const std::optional<replication::ReceivedSnapshot> snapshot = connection.ReadSnapshot(bytes);
  if (!snapshot.has_value()) return;
  figures.Work(kUnitsToRead + kUnitsToTakeABody * std::ssize(snapshot->bodies));
  if (time.GoesBack(snapshot->tick)) StartOver(now);
  figures.TookRecords(snapshot->full_records, snapshot->bodies.size() - snapshot->full_records);
  inputs.NoteLast(snapshot->last_input);
  inputs.SkipPast(snapshot->last_input);
  time.Arrived(now, snapshot->tick);
  recording.Snapshot(now, connection.region(), *snapshot);
  world.Take(now, connection.region(), *snapshot, events);
  NoteApplied(now, connection, *snapshot);
  if (connection.AcknowledgementUrgent()) figures.Sent(connection.Send(now, network, {}));
}

}  // namespace tessera::client
