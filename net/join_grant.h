// JoinGrant: all that a client needs to get into a running world, as one opaque blob.
//
// The control plane makes it once a player has joined; a game's backend, or any other program, passes it on; the client
// library connects to the regions with it and needs no control plane, no gRPC and no protobuf. It is secret as a whole:
// who has it plays as this player. It does not run out by itself: it is void once its player has left, and useless once
// none of its addresses answers any more. docs/protocol.md, "The join grant", has its bytes.
//
//   std::vector<std::uint8_t> blob = EncodeJoinGrant(grant);      // the control plane
//   absl::StatusOr<JoinGrant> same = DecodeJoinGrant(blob);       // the client
//
// Thread rule: free functions and plain values.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/ids.h"
#include "core/world/partition_map.h"
#include "net/credential.h"

namespace tessera::net {

struct GrantedRegion {
  RegionId region;
  std::string host;  // IPv4 address or name
  std::uint16_t port = 0;
  Incarnation incarnation{};  // 0: not known
  friend bool operator==(const GrantedRegion&, const GrantedRegion&) = default;
};

struct JoinGrant {
  PlayerNumber player;      // or a viewer's number
  Credentials credentials;  // that player's, with the instance's id and public key
  PartitionMap map;
  std::vector<GrantedRegion> regions;  // one for each region of the map, ascending
  std::string scene_hash;              // SceneHash: 64 lower-case hexadecimal digits
  std::uint32_t tick_rate_hz = 0, snapshot_rate_hz = 0;
  std::uint32_t expected_players = 0;  // with which the world starts
};

// Bytes of the largest grant that is read: a map of kMaxCells cells and kMaxRegions regions, each with the longest
// host.
inline constexpr std::size_t kMaxJoinGrantBytes = std::size_t{1} << 20;
inline constexpr std::size_t kMaxHostBytes = 255;         // the longest host name, by RFC 1035
inline constexpr std::uint32_t kMaxGrantedRateHz = 1000;  // for ticks and for snapshots
inline constexpr std::uint32_t kJoinGrantVersion = 1;

// `grant` is one that CheckJoinGrant accepts. The same grant gives the same bytes.
std::vector<std::uint8_t> EncodeJoinGrant(const JoinGrant& grant);

// Checks of DecodeJoinGrant beyond the form, for those who make a grant of an answer from elsewhere.
absl::Status CheckJoinGrant(const JoinGrant& grant);

// Errors, INVALID_ARGUMENT naming the field: "grant: this is no join grant", "grant: of version 2; this library reads
// 1", "regions.host: truncated", "regions: not those of the map", "credential: is of player 3, the grant of 4",
// "checksum: the grant is damaged". The regions decide whether the credential is genuine.
absl::StatusOr<JoinGrant> DecodeJoinGrant(std::span<const std::uint8_t> bytes);

}  // namespace tessera::net
