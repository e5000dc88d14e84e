#include "client_sdk/session.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace tessera::client {

Session SessionFrom(net::JoinGrant grant) {
  return {.player = grant.player,
          .credentials = std::move(grant.credentials),
          .map = std::move(grant.map),
          .regions = std::move(grant.regions),
          .scene_hash = std::move(grant.scene_hash),
          .scene = nullptr,
          .tick_rate_hz = grant.tick_rate_hz,
          .snapshot_rate_hz = std::min(grant.snapshot_rate_hz, grant.tick_rate_hz),
          .expected_players = grant.expected_players};
}

net::JoinGrant GrantFrom(const Session& session) {
  return {.player = session.player,
          .credentials = session.credentials,
          .map = session.map,
          .regions = session.regions,
          .scene_hash = session.scene_hash,
          .tick_rate_hz = session.tick_rate_hz,
          .snapshot_rate_hz = session.snapshot_rate_hz,
          .expected_players = session.expected_players};
}

absl::StatusOr<RegionEndpoint> EndpointFrom(std::uint32_t region, const std::string& host, std::uint32_t port,
                                            std::uint64_t incarnation) {
  if (region == 0) return absl::InvalidArgumentError("region: is 0");
  if (host.empty() || host.size() > net::kMaxHostBytes) {
    return absl::InvalidArgumentError(absl::StrCat("region ", region, " has no host"));
  }
  if (port == 0 || port > 65535) return absl::InvalidArgumentError(absl::StrCat("region ", region, " has port ", port));
  return RegionEndpoint{RegionId(region), host, static_cast<std::uint16_t>(port), Incarnation(incarnation)};
}

std::vector<std::uint8_t> ReturnTokenOf(const net::Credentials& credentials) {
  std::vector<std::uint8_t> both = credentials.statement;
  const net::Seed seed = credentials.key.seed();
  both.insert(both.end(), seed.data(), seed.data() + seed.size());
  return both;
}

}  // namespace tessera::client
