#include "client_sdk/connected_regions.h"

#include <algorithm>
#include <utility>

namespace tessera::client {
namespace {

// Margins beyond the radius of interest, as shares of it: a region is connected to before any of its bodies can come
// into sight, and dropped when none can have been in sight for a while. The server's own hysteresis lies between.
constexpr double kConnectBeyond = 0.25, kDropBeyond = 0.5;

}  // namespace

ConnectedRegions::ConnectedRegions(PartitionMap map, const std::vector<RegionEndpoint>& regions, const Scene& scene)
    : map_(std::move(map)), world_bounds_(scene.bounds), settings_(replication::SnapshotSettingsFor(scene)) {
  for (const RegionEndpoint& region : regions) {
    endpoints_.emplace(region.region, region);
    connections_.emplace_back(region, world_bounds_, settings_);
  }
}

RegionConnection* ConnectedRegions::Of(net::PeerHandle peer) {
  const auto found = std::ranges::find(connections_, peer, &RegionConnection::peer);
  return found == connections_.end() ? nullptr : &*found;
}

bool ConnectedRegions::AnyWelcomed() const { return std::ranges::any_of(connections_, &RegionConnection::welcomed); }

bool ConnectedRegions::AnyHeard(const ClientEndpoint& network, std::chrono::milliseconds within) const {
  return std::ranges::any_of(connections_, [&](const RegionConnection& connection) {
    return connection.welcomed() && network.StatsOf(connection.peer()).heard_ago < within;
  });
}

bool ConnectedRegions::AllWelcomed() const {
  return !connections_.empty() && std::ranges::all_of(connections_, &RegionConnection::welcomed);
}

bool ConnectedRegions::IsWelcomed(RegionId region) const {
  const auto found = std::ranges::find(connections_, region, &RegionConnection::region);
  return found != connections_.end() && found->welcomed();
}

std::vector<RegionId> ConnectedRegions::Welcomed() const {
  std::vector<RegionId> welcomed;
  for (const RegionConnection& connection : connections_) {
    if (connection.welcomed()) welcomed.push_back(connection.region());
  }
  return welcomed;
}

const RegionConnection* ConnectedRegions::Mute() const {
  const auto mute = std::ranges::find(connections_, false, &RegionConnection::welcomed);
  return mute == connections_.end() ? nullptr : &*mute;
}

void ConnectedRegions::Begin(const Scene& scene) {
  world_bounds_ = scene.bounds;
  settings_ = replication::SnapshotSettingsFor(scene);
  interest_radius_m_ = settings_.interest_radius_m;
  for (RegionConnection& connection : connections_) connection.Begin(world_bounds_, settings_);
  follow_due_ = true;
}

void ConnectedRegions::Start() {
  started_ = true;
  follow_due_ = true;  // until then the client is connected to every region
}

ConnectedRegions::News ConnectedRegions::AdoptMap(const replication::AnnouncedMap& announced) {
  if (announced.version <= map_.version()) return News::kOld;
  absl::StatusOr<PartitionMap> map = announced.Make();
  if (!map.ok()) return News::kMalformed;
  map_ = *std::move(map);
  follow_due_ = true;
  return News::kNew;
}

std::size_t ConnectedRegions::AdoptEndpoints(const std::vector<replication::AnnouncedEndpoint>& announced) {
  std::size_t malformed = 0;
  for (const replication::AnnouncedEndpoint& endpoint : announced) {
    absl::StatusOr<RegionEndpoint> where =
        EndpointFrom(endpoint.region, endpoint.host, endpoint.game_port, endpoint.incarnation);
    if (!where.ok()) {
      ++malformed;
      continue;
    }
    const auto [known, fresh] = endpoints_.try_emplace(where->region, *where);
    if (!fresh && where->incarnation <= known->second.incarnation) continue;
    known->second = *std::move(where);
    follow_due_ = true;
  }
  return malformed;
}

bool ConnectedRegions::Renew(PartitionMap map, std::vector<RegionEndpoint> regions, ClientEndpoint& network) {
  for (RegionEndpoint& endpoint : regions) {
    const auto known = endpoints_.find(endpoint.region);
    const bool older = known != endpoints_.end() && endpoint.incarnation < known->second.incarnation;
    if (older && endpoint.incarnation != Incarnation()) continue;
    endpoints_.insert_or_assign(endpoint.region, std::move(endpoint));
  }
  const bool newer = map.version() > map_.version();
  if (newer) map_ = std::move(map);
  for (RegionConnection& connection : connections_) {
    const auto endpoint = endpoints_.find(connection.region());
    if (!connection.welcomed() && endpoint != endpoints_.end()) connection.Move(endpoint->second, network);
  }
  follow_due_ = true;
  return newer;
}

bool ConnectedRegions::Disconnected(TimePoint now, RegionConnection& connection) {
  const bool lost = connection.welcomed();
  connection.Disconnected(now);
  if (lost) lost_.insert(connection.region());
  return lost;
}

void ConnectedRegions::DialAgain(TimePoint now, const std::string& why) {
  for (RegionConnection& connection : connections_) {
    connection.Failed(why);
    connection.Disconnected(now);
    lost_.insert(connection.region());
  }
}

bool ConnectedRegions::Welcomed(RegionConnection& connection) {
  connection.Welcomed();
  return lost_.erase(connection.region()) > 0;
}

ConnectedRegions::Left ConnectedRegions::AfterStop(const Interest& interest) {
  const auto stopped = [](const RegionConnection& l) { return l.state() == RegionConnection::State::kStopped; };
  if (!std::ranges::all_of(connections_, stopped)) return Left::kSome;
  // The map may name other regions: some that replace these, and some that were too far away to connect to.
  bool any_new = false, any_near = false;
  for (const MapRegion& region : map_.regions()) {
    if (std::ranges::find(connections_, region.id, &RegionConnection::region) != connections_.end()) continue;
    any_new = true;
    any_near = any_near || Near(region.id, interest, 0);
  }
  if (!any_new) return std::ranges::any_of(connections_, &RegionConnection::goes_on) ? Left::kSame : Left::kNone;
  searching_ = searching_ || !any_near;
  follow_due_ = true;
  return Left::kOthers;
}

void ConnectedRegions::Search() {
  if (!searching_) searching_ = follow_due_ = true;
}

void ConnectedRegions::EndSearchIfFound(const Interest& interest) {
  searching_ = searching_ && std::ranges::none_of(connections_, [&](const RegionConnection& connection) {
                 return connection.welcomed() && Touches(connection.region(), interest, 0);
               });
}

template <class Keeps>
std::vector<RegionStats> ConnectedRegions::DropUnless(ClientEndpoint& network, const Keeps& keeps) {
  std::vector<RegionStats> dropped;
  for (auto connection = connections_.begin(); connection != connections_.end();) {
    if (keeps(connection->region())) {
      ++connection;
      continue;
    }
    connection->Stop(network);
    dropped.push_back(connection->Stats(network));
    connection = connections_.erase(connection);
  }
  return dropped;
}

std::vector<RegionStats> ConnectedRegions::DropGone(ClientEndpoint& network) {
  follow_due_ = false;
  return DropUnless(network, [&](RegionId region) { return map_.HasRegion(region); });
}

std::vector<RegionStats> ConnectedRegions::DropFar(const Interest& interest, ClientEndpoint& network) {
  return DropUnless(network, [&](RegionId region) { return Near(region, interest, kDropBeyond * interest_radius_m_); });
}

std::vector<RegionId> ConnectedRegions::MoveToEndpoints(TimePoint now, ClientEndpoint& network) {
  std::vector<RegionId> lost;
  for (RegionConnection& connection : connections_) {
    const auto endpoint = endpoints_.find(connection.region());
    if (endpoint == endpoints_.end() || endpoint->second.incarnation <= connection.where().incarnation) continue;
    if (connection.welcomed() && Disconnected(now, connection)) lost.push_back(connection.region());
    connection.Move(endpoint->second, network);
  }
  return lost;
}

void ConnectedRegions::AddNear(const Interest& interest) {
  for (const MapRegion& region : map_.regions()) {
    const auto at = std::ranges::lower_bound(connections_, region.id, {}, &RegionConnection::region);
    if (at != connections_.end() && at->region() == region.id) continue;
    const auto endpoint = endpoints_.find(region.id);
    if (endpoint == endpoints_.end() || !Near(region.id, interest, kConnectBeyond * interest_radius_m_)) continue;
    connections_.emplace(at, endpoint->second, world_bounds_, settings_);
  }
}

void ConnectedRegions::Dial(TimePoint now, ClientEndpoint& network, const net::Credentials& credentials) {
  for (RegionConnection& connection : connections_) connection.DialIfDue(now, network, credentials);
}

bool ConnectedRegions::Near(RegionId region, const Interest& interest, double more_m) const {
  return interest_radius_m_ <= 0 || !started_ || searching_ || Touches(region, interest, more_m);
}

// Whether bodies of the region may be within the radius of interest and `more_m`.
bool ConnectedRegions::Touches(RegionId region, const Interest& interest, double more_m) const {
  if (!interest.centre) return true;
  const double radius = interest_radius_m_ + more_m;
  const Vec3d reach{radius, 0, radius};
  if (map_.Reaches(region, {*interest.centre - reach, *interest.centre + reach})) return true;
  // The owner of the own body stays connected wherever the map has it: a handover may be under way.
  return interest.owner == region;
}

}  // namespace tessera::client
