// Following the map: a client is connected to the regions that its interest touches.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"

namespace tessera::client {
namespace {

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
  if (!follow_due && (interest_radius_m <= 0 || !progress.started())) return;
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
  return interest_radius_m <= 0 || !progress.started() || searching || Touches(region, more_m);
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
  const bool any = std::ranges::any_of(connections, &RegionConnection::welcomed);
  const ClientProgress::Due due = progress.Look(
      now,
      {.scene = !delivery.under_way(), .all_welcomed = !connections.empty() && AllWelcomed(), .any_welcomed = any});
  if (due.late) return EndJoining();
  if (any) {
    const auto found = [this](const RegionConnection& l) { return l.welcomed() && Touches(l.region(), 0); };
    searching = searching && std::none_of(connections.begin(), connections.end(), found);
  }
  if (due.search && !searching) searching = follow_due = true;
  if (due.ask_grant) events.push_back({.kind = ClientEvent::Kind::kGrantNeeded});
  if (!due.lost) return;
  End(absl::UnavailableError(absl::StrCat("instance ", settings.instance_id, ": no region answers any more")), "",
      settings.by_grant);
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
  progress.EndSilence();
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
  const bool no_one = std::none_of(connections.begin(), connections.end(), welcomed);
  const std::string error = mute->last_error().empty() ? "" : absl::StrCat(": ", mute->last_error());
  End(absl::DeadlineExceededError(absl::StrCat(mute->Where(), " does not answer", error)), "",
      settings.by_grant && no_one);
}

void Client::Impl::End(absl::Status why, std::string detail, bool needs_new_grant) {
  if (!progress.End(std::move(why), needs_new_grant)) return;
  prediction.DropThrown(world, events);
  if (detail.empty()) detail = std::string(progress.reason().message());
  for (RegionConnection& connection : connections) connection.Stop(network);
  events.push_back({.kind = ClientEvent::Kind::kEnded, .detail = std::move(detail)});
}

}  // namespace tessera::client
