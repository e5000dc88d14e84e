// ConnectToken: the control plane's word that a player may enter an instance, sealed with the instance's key so that
// every region checks it alone and nobody else can read or make one.
//
// XChaCha20-Poly1305 (libsodium) over the fields, with the protocol version and instance id as associated data.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/ids.h"

namespace tessera::net {

inline constexpr std::size_t kInstanceKeyBytes = 32;
using InstanceKey = std::array<std::uint8_t, kInstanceKeyBytes>;

struct ConnectToken {
  std::string instance_id;
  PlayerNumber player;
  std::uint64_t expires_unix_s = 0;
};

InstanceKey MakeInstanceKey();                                        // random
absl::StatusOr<InstanceKey> InstanceKeyFrom(std::string_view bytes);  // INVALID_ARGUMENT unless 32 bytes

std::vector<std::uint8_t> Seal(const ConnectToken& token, const InstanceKey& key);
// Errors: UNAUTHENTICATED (damaged, or another key or protocol), NOT_FOUND (another instance; both are named),
// DEADLINE_EXCEEDED (expired).
absl::StatusOr<ConnectToken> Open(std::span<const std::uint8_t> sealed, const std::string& instance_id,
                                  const InstanceKey& key, std::uint64_t now_unix_s);

// Proof in LinkHello: keyed BLAKE2b-256 over the fields.
std::vector<std::uint8_t> LinkProof(const InstanceKey& key, const std::string& instance_id, RegionId region,
                                    Incarnation incarnation, MapVersion map_version);

}  // namespace tessera::net
