// ConnectToken: the statement of a holder of an instance's key that somebody may connect, sealed with that key, so that
// every region checks it alone and nobody else can read or make one.
//
// The control plane issues tokens to players; a region issues its own when it dials a neighbour. With each goes a
// session key, derived from the instance's key and the token's id: its holder proves with it that the token is its own,
// and it never travels to a region. XChaCha20-Poly1305 over the fields, with protocol version and instance id as
// associated data (docs/protocol.md).
//
//   const Credentials issued = Issue({.instance_id = "plaza-1", .player = PlayerNumber(7), .expires_unix_s = t}, key);
//   Open(issued.token, "plaza-1", key, now) -> the fields;  SessionKeyOf(issued.token, key) == issued.key
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/ids.h"
#include "net/secret.h"

namespace tessera::net {

inline constexpr std::size_t kKeyBytes = 32;
using InstanceKey = Secret<kKeyBytes>;
using SessionKey = Secret<kKeyBytes>;

// Names a player, or a region that dials its neighbour: exactly one of `player` and `region` is given.
struct ConnectToken {
  std::string instance_id;
  PlayerNumber player{};
  std::uint64_t expires_unix_s = 0;
  RegionId region{};
  Incarnation incarnation{};  // with `region`
};

// A token with its session key: all that its holder needs to connect. Secret as a whole.
struct Credentials {
  std::vector<std::uint8_t> token;
  SessionKey key;
};

inline constexpr std::size_t kMaxTokenBytes = 24 + 2 + 255 + 24 + 16;

InstanceKey MakeInstanceKey();                                        // random
absl::StatusOr<InstanceKey> InstanceKeyFrom(std::string_view bytes);  // INVALID_ARGUMENT unless 32 bytes
absl::StatusOr<SessionKey> SessionKeyFrom(std::string_view bytes);    // likewise

std::vector<std::uint8_t> Seal(const ConnectToken& token, const InstanceKey& key);
// Requires at least the bytes of a token, e.g. one that opened.
SessionKey SessionKeyOf(std::span<const std::uint8_t> sealed, const InstanceKey& key);
Credentials Issue(const ConnectToken& token, const InstanceKey& key);
// Errors: UNAUTHENTICATED (damaged, or another key or protocol), NOT_FOUND (another instance; both are named),
// DEADLINE_EXCEEDED (expired).
absl::StatusOr<ConnectToken> Open(std::span<const std::uint8_t> sealed, const std::string& instance_id,
                                  const InstanceKey& key, std::uint64_t now_unix_s);

}  // namespace tessera::net
