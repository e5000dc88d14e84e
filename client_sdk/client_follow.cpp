// Following the map: a client is connected to the regions that its interest touches.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"

namespace tessera::client {
namespace {

// Without any region for so long, the instance counts as lost; shorter than that, a failover may bring it back.
constexpr std::chrono::seconds kMaxSilence{30};
// After so long without an answer all regions of the map are dialled: the regions that replace those that were near may
// lie elsewhere.
constexpr std::chrono::seconds kSearchAfter{1};
// After so long none of the addresses that the client knows leads anywhere, as far as it can tell: longer than a
// failover takes.
constexpr std::chrono::seconds kAskForGrantAfter{3};
// Margins beyond the radius of interest, as shares of it: a region is connected to before any of its bodies can come
// into sight, and dropped when none can have been in sight for a while. The server's own hysteresis lies between.
constexpr double kConnectBeyond = 0.25, kDropBeyond = 0.5;

}  // namespace

void Client::Impl::AdoptMap(RegionConnection& from, const replication::AnnouncedMap& announced) {
  if (announced.version <= session.map.version()) return;
  absl::StatusOr<PartitionMap> map = announced.Make();
  if (!map.ok()) return from.CountError();
  session.map = *std::move(map);
  follow_due = true;
  if (recorder) recorder->Map(*last_poll, WrittenMap(session.map));
  events.push_back({.kind = ClientEvent::Kind::kMapChanged});
}

void Client::Impl::AdoptEndpoints(RegionConnection& from,
                                  const std::vector<replication::AnnouncedEndpoint>& announced) {
  for (const replication::AnnouncedEndpoint& endpoint : announced) {
    absl::StatusOr<RegionEndpoint> where =
        EndpointFrom(endpoint.region, endpoint.host, endpoint.game_port, endpoint.incarnation);
    if (!where.ok()) {
      from.CountError();
      continue;
    }
    const auto [known, fresh] = endpoints.try_emplace(where->region, *where);
    if (!fresh && where->incarnation <= known->second.incarnation) continue;
    known->second = *std::move(where);
    follow_due = true;
  }
}

void Client::Impl::Follow(TimePoint now) {
  if (!follow_due && (interest_radius_m <= 0 || !started)) return;
  follow_due = false;
  DropGone(now);
  DropFar(now);
  MoveConnections(now);
  AddMissing();
}

void Client::Impl::DropGone(TimePoint now) {
  for (auto connection = connections.begin(); connection != connections.end();) {
    if (session.map.HasRegion(connection->region())) {
      ++connection;
      continue;
    }
    RegionChanged(now, connection->region(), RegionEntry::Change::kGone);
    connection = Drop(connection);
  }
}

void Client::Impl::DropFar(TimePoint now) {
  for (auto connection = connections.begin(); connection != connections.end();) {
    if (Near(connection->region(), kDropBeyond * interest_radius_m)) {
      ++connection;
      continue;
    }
    RegionChanged(now, connection->region(), RegionEntry::Change::kOutOfSight);
    connection = Drop(connection);
  }
}

void Client::Impl::MoveConnections(TimePoint now) {
  for (RegionConnection& connection : connections) {
    const auto endpoint = endpoints.find(connection.region());
    if (endpoint == endpoints.end() || endpoint->second.incarnation <= connection.where().incarnation) continue;
    if (connection.welcomed()) OnDisconnected(now, connection);
    connection.Move(endpoint->second, network);
  }
}

void Client::Impl::AddMissing() {
  for (const MapRegion& region : session.map.regions()) {
    const auto at =
        std::lower_bound(connections.begin(), connections.end(), region.id,
                         [](const RegionConnection& connection, RegionId id) { return connection.region() < id; });
    if (at != connections.end() && at->region() == region.id) continue;
    const auto endpoint = endpoints.find(region.id);
    if (endpoint == endpoints.end() || !Near(region.id, kConnectBeyond * interest_radius_m)) continue;
    connections.emplace(at, endpoint->second, session.scene->bounds, replication::SnapshotSettingsFor(*session.scene));
  }
}

std::vector<RegionConnection>::iterator Client::Impl::Drop(std::vector<RegionConnection>::iterator connection) {
  connection->Stop(network);
  figures.Dropped(connection->Stats(network));
  return connections.erase(connection);
}

bool Client::Impl::Near(RegionId region, double more_m) const {
  return interest_radius_m <= 0 || !started || searching || Touches(region, more_m);
}

// Whether bodies of the region may be within the radius of interest and `more_m`.
bool Client::Impl::Touches(RegionId region, double more_m) const {
  if (own.watches()) return true;
  const std::optional<Vec3d> centre = own.Position(world, *session.scene);
  if (!centre.has_value()) return true;
  const double radius = interest_radius_m + more_m;
  const Vec3d reach{radius, 0, radius};
  if (session.map.Reaches(region, {*centre - reach, *centre + reach})) return true;
  // The owner of the own body stays connected wherever the map has it: a handover may be under way.
  return world.OwnerOf(own.id()) == region;
}

void Client::Impl::CheckProgress(TimePoint now) {
  if (!joined_by.has_value()) joined_by = now + settings.deadline;
  if (state == ClientState::kJoining && !delivery.under_way() && !connections.empty() && AllWelcomed())
    state = ClientState::kWaiting;
  if (state == ClientState::kWaiting && started) state = ClientState::kPlaying;
  if (state == ClientState::kJoining && now >= *joined_by) return EndJoining();
  if (std::any_of(connections.begin(), connections.end(), [](const RegionConnection& l) { return l.welcomed(); })) {
    silent_since.reset();
    asked_for_grant = false;
    const auto found = [this](const RegionConnection& l) { return l.welcomed() && Touches(l.region(), 0); };
    searching = searching && std::none_of(connections.begin(), connections.end(), found);
    return;
  }
  if (!silent_since.has_value()) silent_since = now;
  if (now - *silent_since >= kSearchAfter && !searching) searching = follow_due = true;
  if (now - *silent_since >= kAskForGrantAfter && state != ClientState::kJoining && !asked_for_grant) {
    asked_for_grant = true;
    events.push_back({.kind = ClientEvent::Kind::kGrantNeeded});
  }
  if (now - *silent_since >= kMaxSilence && state != ClientState::kJoining) {
    needs_new_grant = settings.by_grant;
    End(absl::UnavailableError(absl::StrCat("instance ", settings.instance_id, ": no region answers any more")), "");
  }
}

// Another grant for the same player: it knows where the regions are now.
void Client::Impl::Renew(Session fresh) {
  session.credentials = std::move(fresh.credentials);
  for (RegionEndpoint& endpoint : fresh.regions) {
    const auto known = endpoints.find(endpoint.region);
    const bool older = known != endpoints.end() && endpoint.incarnation < known->second.incarnation;
    if (older && endpoint.incarnation != Incarnation()) continue;
    endpoints.insert_or_assign(endpoint.region, std::move(endpoint));
  }
  if (fresh.map.version() > session.map.version()) {
    session.map = std::move(fresh.map);
    events.push_back({.kind = ClientEvent::Kind::kMapChanged});
  }
  for (RegionConnection& connection : connections) {
    const auto endpoint = endpoints.find(connection.region());
    if (!connection.welcomed() && endpoint != endpoints.end()) connection.Move(endpoint->second, network);
  }
  silent_since.reset();
  asked_for_grant = false;
  follow_due = true;
}

// The world goes on from a moment that was seen before: nothing that is known of it holds.
void Client::Impl::StartOver(TimePoint now) {
  events.push_back({.kind = ClientEvent::Kind::kRestored});
  world.Clear(events);
  properties.ForgetNews();
  for (const RegionConnection& connection : connections) {
    if (connection.welcomed()) world.RegionBegins(now, connection.region());
  }
  pairs = PairBook();
  time.StartOver(now);
  inputs.Forget();
  prediction.Forget();
}

// The time to join is over.
void Client::Impl::EndJoining() {
  const auto mute =
      std::find_if(connections.begin(), connections.end(), [](const RegionConnection& l) { return !l.welcomed(); });
  if (mute == connections.end()) {
    const std::string what = delivery.under_way() ? "the regions do not send the scene" : "there are no regions";
    return End(absl::DeadlineExceededError(absl::StrCat("instance ", settings.instance_id, ": ", what)), "");
  }
  const auto welcomed = [](const RegionConnection& l) { return l.welcomed(); };
  needs_new_grant = settings.by_grant && std::none_of(connections.begin(), connections.end(), welcomed);
  const std::string error = mute->last_error().empty() ? "" : absl::StrCat(": ", mute->last_error());
  End(absl::DeadlineExceededError(absl::StrCat(mute->Where(), " does not answer", error)), "");
}

void Client::Impl::End(absl::Status why, std::string detail) {
  if (state == ClientState::kEnded) return;
  state = ClientState::kEnded;
  prediction.DropThrown(world, events);
  reason = std::move(why);
  if (detail.empty()) detail = std::string(reason.message());
  for (RegionConnection& connection : connections) connection.Stop(network);
  events.push_back({.kind = ClientEvent::Kind::kEnded, .detail = std::move(detail)});
}

}  // namespace tessera::client
