// Session: what a client has joined: who it is, where the regions are, and the scene once that is here.
//
// Thread rule: plain values and free functions.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/world/partition_map.h"
#include "core/world/scene.h"
#include "net/credential.h"
#include "net/join_grant.h"

namespace tessera::client {

using RegionEndpoint = net::GrantedRegion;  // the endpoint with the higher incarnation replaces the other

struct Session {
  PlayerNumber player;           // or a viewer's number
  net::Credentials credentials;  // secret
  PartitionMap map;
  std::vector<RegionEndpoint> regions;  // one for each region of the map, ascending
  std::string scene_hash;
  std::shared_ptr<const Scene> scene;  // null until it is here
  std::uint32_t tick_rate_hz = 0, snapshot_rate_hz = 0, expected_players = 0;
};

Session SessionFrom(net::JoinGrant grant);
net::JoinGrant GrantFrom(const Session& session);

// Checks the endpoint that a message gives of a region: INVALID_ARGUMENT naming the field.
absl::StatusOr<RegionEndpoint> EndpointFrom(std::uint32_t region, const std::string& host, std::uint32_t port,
                                            std::uint64_t incarnation);

// Makes its holder the player: the credential, then the seed of its key. Secret.
std::vector<std::uint8_t> ReturnTokenOf(const net::Credentials& credentials);
inline constexpr std::size_t kMaxReturnTokenBytes = net::kMaxCredentialBytes + net::kKeyBytes;

}  // namespace tessera::client
