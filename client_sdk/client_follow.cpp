// Which regions a client is connected to: those of the map that its interest touches.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"
#include "core/world/partition_io.h"

namespace tessera::client {
namespace {

// Without any region for so long, the instance counts as lost; shorter than that, a failover may bring it back.
constexpr std::chrono::seconds kMaxSilence{30};
// After so long all regions of the map are asked: who has taken the place of those that were near may not be one of
// them.
constexpr std::chrono::seconds kSearchAfter{1};
// Beyond the radius of interest, by shares of it: regions are connected to before anything of them can come into sight,
// and let go of when nothing of them can have been in it for a while. What the server does at the edge lies between.
constexpr double kConnectBeyond = 0.25, kLetGoBeyond = 0.5;

}  // namespace

void Client::Impl::AdoptMap(RegionLink& from, const v1::PartitionMap& proto) {
  if (proto.version() <= session.map.version().value()) return;
  absl::StatusOr<PartitionMap> map = FromProto(proto);
  if (!map.ok()) return from.CountError();
  session.map = *std::move(map);
  follow_due = true;
  if (recorder) recorder->Map(*last_poll, proto.SerializeAsString());
  events.push_back({.kind = ClientEvent::Kind::kMapChanged});
}

void Client::Impl::AdoptEndpoints(RegionLink& from,
                                  const google::protobuf::RepeatedPtrField<v1::RegionEndpoint>& told) {
  for (const v1::RegionEndpoint& endpoint : told) {
    absl::StatusOr<RegionEndpoint> where =
        EndpointFrom(endpoint.region(), endpoint.host(), endpoint.game_port(), endpoint.incarnation());
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
  MoveLinks(now);
  AddMissing();
}

void Client::Impl::DropGone(TimePoint now) {
  for (auto link = links.begin(); link != links.end();) {
    if (session.map.HasRegion(link->region())) {
      ++link;
      continue;
    }
    RegionChanged(now, link->region(), RegionEntry::Change::kGone);
    link = LetGo(link);
  }
}

void Client::Impl::DropFar(TimePoint now) {
  for (auto link = links.begin(); link != links.end();) {
    if (Near(link->region(), kLetGoBeyond * interest_radius_m)) {
      ++link;
      continue;
    }
    RegionChanged(now, link->region(), RegionEntry::Change::kOutOfSight);
    link = LetGo(link);
  }
}

void Client::Impl::MoveLinks(TimePoint now) {
  for (RegionLink& link : links) {
    const auto endpoint = endpoints.find(link.region());
    if (endpoint == endpoints.end() || endpoint->second.incarnation <= link.where().incarnation) continue;
    if (link.welcomed()) OnDisconnected(now, link);
    link.Move(endpoint->second, wire);
  }
}

void Client::Impl::AddMissing() {
  for (const MapRegion& region : session.map.regions()) {
    const auto at = std::lower_bound(links.begin(), links.end(), region.id,
                                     [](const RegionLink& link, RegionId id) { return link.region() < id; });
    if (at != links.end() && at->region() == region.id) continue;
    const auto endpoint = endpoints.find(region.id);
    if (endpoint == endpoints.end() || !Near(region.id, kConnectBeyond * interest_radius_m)) continue;
    links.emplace(at, endpoint->second, session.scene->bounds, replication::SnapshotSettingsFor(*session.scene));
  }
}

std::vector<RegionLink>::iterator Client::Impl::LetGo(std::vector<RegionLink>::iterator link) {
  link->Stop(wire);
  const RegionStats stats = link->Stats(wire);
  let_go.datagrams += stats.datagrams;
  let_go.datagrams_lost += stats.datagrams_lost;
  let_go.decode_errors += stats.decode_errors;
  let_go.reconnects += stats.reconnects;
  return links.erase(link);
}

bool Client::Impl::Near(RegionId region, double more_m) const {
  return interest_radius_m <= 0 || !started || searching || Touches(region, more_m);
}

// Whether something of the region may be within `more_m` of what is of interest.
bool Client::Impl::Touches(RegionId region, double more_m) const {
  const std::optional<Vec3d> centre = OwnPosition();
  if (!centre.has_value()) return true;
  const double radius = interest_radius_m + more_m;
  const Vec3d reach{radius, 0, radius};
  if (session.map.Reaches(region, {*centre - reach, *centre + reach})) return true;
  // The owner of the own body is listened to wherever the map has it: a handover may be under way.
  return world.OwnerOf(PlayerBodyId(session.player)) == region;
}

std::optional<Vec3d> Client::Impl::OwnPosition() const {
  const auto own = world.bodies().find(PlayerBodyId(session.player));
  if (own != world.bodies().end()) return own->second.state.position;
  if (!session.scene->player) return std::nullopt;
  const std::vector<Vec3d>& spawns = session.scene->player->spawn_points;
  if (spawns.empty()) return std::nullopt;
  return spawns[(session.player.value() - 1) % spawns.size()];
}

void Client::Impl::CheckProgress(TimePoint now) {
  if (!joined_by.has_value()) joined_by = now + options.deadline;
  if (state == ClientState::kJoining && !links.empty() && AllWelcomed()) state = ClientState::kWaiting;
  if (state == ClientState::kWaiting && started) state = ClientState::kPlaying;
  if (state == ClientState::kJoining && now >= *joined_by) {
    const auto mute = std::find_if(links.begin(), links.end(), [](const RegionLink& l) { return !l.welcomed(); });
    const std::string error = mute->last_error().empty() ? "" : absl::StrCat(": ", mute->last_error());
    return End(absl::DeadlineExceededError(absl::StrCat(mute->Where(), " does not answer", error)), "");
  }
  if (std::any_of(links.begin(), links.end(), [](const RegionLink& l) { return l.welcomed(); })) {
    silent_since.reset();
    const auto found = [this](const RegionLink& l) { return l.welcomed() && Touches(l.region(), 0); };
    searching = searching && std::none_of(links.begin(), links.end(), found);
    return;
  }
  if (!silent_since.has_value()) silent_since = now;
  if (now - *silent_since >= kSearchAfter && !searching) searching = follow_due = true;
  if (now - *silent_since >= kMaxSilence && state != ClientState::kJoining) {
    End(absl::UnavailableError(absl::StrCat("instance ", options.instance_id, ": no region answers any more")), "");
  }
}

void Client::Impl::End(absl::Status why, std::string detail) {
  if (state == ClientState::kEnded) return;
  state = ClientState::kEnded;
  reason = std::move(why);
  if (detail.empty()) detail = std::string(reason.message());
  for (RegionLink& link : links) link.Stop(wire);
  events.push_back({.kind = ClientEvent::Kind::kEnded, .detail = std::move(detail)});
}

}  // namespace tessera::client
