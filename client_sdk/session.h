// Session: a client's requests to the control plane. The only part of the SDK that knows gRPC.
//
// Calls wait, up to their deadline. Thread rule: any thread; no state but the cache of scenes, which is locked.
#pragma once

#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/world/partition_map.h"
#include "core/world/scene.h"
#include "net/credential.h"
#include "trust/credentials.h"

namespace tessera::client {

struct RegionEndpoint {
  RegionId region;
  std::string host;
  std::uint16_t port = 0;
  Incarnation incarnation{};  // the endpoint with the higher one replaces the other
};

struct Session {
  PlayerNumber player;           // or a viewer's number
  net::Credentials credentials;  // secret
  PartitionMap map;
  std::vector<RegionEndpoint> regions;  // one for each region of the map, ascending
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const std::string> written_scene;  // tessera.v1.Scene that it was made of
  std::uint32_t tick_rate_hz = 0, snapshot_rate_hz = 0;
};

// Checks the endpoint that a message gives of a region: INVALID_ARGUMENT naming the field.
absl::StatusOr<RegionEndpoint> EndpointFrom(std::uint32_t region, const std::string& host, std::uint32_t port,
                                            std::uint64_t incarnation);

// Makes its holder the player: the credential, then the seed of its key. Secret.
std::vector<std::uint8_t> ReturnTokenOf(const net::Credentials& credentials);
inline constexpr std::size_t kMaxReturnTokenBytes = net::kMaxCredentialBytes + net::kKeyBytes;

// A scene that this process has had before, by its hash, is not fetched again. `returning`: a return token that the
// player had before, to come back as the same one; empty for a new one. `watch`: as a viewer.
absl::StatusOr<Session> JoinInstance(const trust::ControlPoint& control, const std::string& instance_id,
                                     const std::string& player_name, std::span<const std::uint8_t> returning,
                                     bool watch, std::chrono::milliseconds deadline);
absl::Status LeaveInstance(const trust::ControlPoint& control, const std::string& instance_id,
                           const net::Credentials& credentials, std::chrono::milliseconds deadline);

}  // namespace tessera::client
