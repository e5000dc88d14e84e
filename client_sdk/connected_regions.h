// ConnectedRegions: the regions that a client is connected to: those that its interest touches, each where the newest
// map and endpoints have it.
//
//   regions.AdoptEndpoints(welcome.endpoints);  regions.AdoptMap(welcome.map);
//   if (regions.FollowDue()) {                              // once a poll, in this order
//     for (dropped : regions.DropGone(network)) ...         // the map has them no more
//     for (dropped : regions.DropFar(interest, network)) ...
//     for (lost : regions.MoveToEndpoints(now, network)) ...
//     regions.AddNear(interest);
//   }
//   regions.Dial(now, network, credentials);
//
// Promise: at most one connection a region, ascending, and none to a region that the map does not have once it has been
// followed. Before the world has started, and while no region that is near answers (Search), all count as near. An
// older map or endpoint never replaces a newer one.
// Thread rule: one thread at a time; time comes in.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/region_connection.h"
#include "core/replication/region_message.h"
#include "core/world/partition_map.h"
#include "core/world/scene.h"

namespace tessera::client {

class ConnectedRegions {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // The part of the world in which a client is interested.
  struct Interest {
    std::optional<Vec3d> centre{};    // nothing: all of the world
    std::optional<RegionId> owner{};  // owns the own body: near wherever the map has it
  };

  ConnectedRegions(PartitionMap map, const std::vector<RegionEndpoint>& regions, const Scene& scene);

  std::span<RegionConnection> all() { return connections_; }
  std::span<const RegionConnection> all() const { return connections_; }
  const PartitionMap& map() const { return map_; }
  RegionConnection* Of(net::PeerHandle peer);  // null: dropped
  bool AnyWelcomed() const;
  // One of them has been heard of within that time.
  bool AnyHeard(const ClientEndpoint& network, std::chrono::milliseconds within) const;
  bool AllWelcomed() const;  // and there is one
  bool IsWelcomed(RegionId region) const;
  std::vector<RegionId> Welcomed() const;
  // One that has not welcomed the client; null: all have.
  const RegionConnection* Mute() const;

  // The scene is here: with its bounds and its radius of interest.
  void Begin(const Scene& scene);
  // The world has started: what is far does not count any more.
  void Start();

  enum class News : std::uint8_t { kMalformed, kOld, kNew };
  News AdoptMap(const replication::AnnouncedMap& announced);
  // How many of them are malformed.
  std::size_t AdoptEndpoints(const std::vector<replication::AnnouncedEndpoint>& announced);
  // For a recording, which has no endpoints.
  void SetMap(PartitionMap map) { map_ = std::move(map); }
  // By another grant, which knows where the regions are now. Whether the map is a newer one.
  bool Renew(PartitionMap map, std::vector<RegionEndpoint> regions, ClientEndpoint& network);

  // The connection has broken. Whether its region is lost by that: it had welcomed the client.
  bool Disconnected(TimePoint now, RegionConnection& connection);
  // All processes have ended, and the world has not: they are dialled where they were, and wherever a grant says.
  void DialAgain(TimePoint now, const std::string& why);
  // The region welcomes the client. Whether it was lost before: one that is dialled for the first time, or at another
  // address, never was.
  bool Welcomed(RegionConnection& connection);

  enum class Left : std::uint8_t {
    kSome,    // there are others that have not stopped
    kOthers,  // none, but the map names others: they are dialled
    kSame,    // none, and no others: their processes alone have ended
    kNone,    // the instance ends
  };
  // After a region has stopped.
  Left AfterStop(const Interest& interest);

  // --- No region answers.
  // All regions count as near until one that is has been found.
  void Search();
  bool searching() const { return searching_; }
  void EndSearchIfFound(const Interest& interest);

  // --- Following the map.
  bool FollowDue() const { return follow_due_ || (interest_radius_m_ > 0 && started_); }
  // The last counts of the connections that are dropped, in both.
  std::vector<RegionStats> DropGone(ClientEndpoint& network);
  std::vector<RegionStats> DropFar(const Interest& interest, ClientEndpoint& network);
  // The regions that are lost by being elsewhere.
  std::vector<RegionId> MoveToEndpoints(TimePoint now, ClientEndpoint& network);
  void AddNear(const Interest& interest);
  void Dial(TimePoint now, ClientEndpoint& network, const net::Credentials& credentials);

 private:
  bool Near(RegionId region, const Interest& interest, double more_m) const;
  bool Touches(RegionId region, const Interest& interest, double more_m) const;
  template <class Keeps>
  std::vector<RegionStats> DropUnless(ClientEndpoint& network, const Keeps& keeps);

  PartitionMap map_;
  std::map<RegionId, RegionEndpoint> endpoints_;  // the newest known of each
  std::vector<RegionConnection> connections_;     // ascending by region
  std::set<RegionId> lost_;                       // that the caller knows to be lost, until they are back
  Aabb world_bounds_;
  replication::SnapshotSettings settings_;
  double interest_radius_m_ = 0;  // 0: all of the world
  bool started_ = false;
  bool follow_due_ = false;  // map or endpoints have changed
  bool searching_ = false;   // no region that is near answers, so all regions of the map are asked
};

}  // namespace tessera::client
