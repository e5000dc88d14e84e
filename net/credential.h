// Credentials: what an instance's key states, once, of who may connect.
//
// A PlayerCredential says that the holder of a key pair is a player, a WorkerCertificate that the holder is one life of
// a region. The control plane signs them with the instance's key; everybody else has only the public half of that, so a
// region verifies and cannot make one. Neither is secret, and neither runs out: a player who has left is refused
// because the orders do not name it any more. docs/protocol.md, "The acceptor", has their bytes.
//
//   const Credentials issued = IssuePlayer("plaza-1", PlayerNumber(7), Generation(1), instance_key);
//   ReadPlayerCredential(issued.statement, "plaza-1", instance_key.verification_key())->player == PlayerNumber(7)
//
// Thread rule: free functions and plain values.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/ids.h"
#include "net/signing_key.h"

namespace tessera::net {

// Counts the joins of a player, from 1: of two processes that have joined as one player, the newer one plays.
using Generation = Id<struct GenerationTag, std::uint64_t>;

struct PlayerCredential {
  std::string instance_id;
  PlayerNumber player{};  // or a viewer's number
  Generation generation{};
  VerificationKey key{};  // the holder's
  friend bool operator==(const PlayerCredential&, const PlayerCredential&) = default;
};

struct WorkerCertificate {
  std::string instance_id;
  RegionId region{};
  Incarnation incarnation{};
  VerificationKey key{};  // the worker's
  friend bool operator==(const WorkerCertificate&, const WorkerCertificate&) = default;
};

// All that somebody needs to connect to the regions of an instance. Secret as a whole.
struct Credentials {
  std::string instance_id;
  std::vector<std::uint8_t> statement;  // a signed PlayerCredential or WorkerCertificate
  SigningKey key;                       // its public half is in the statement
  VerificationKey instance_key{};       // by which the certificates of regions must verify
};

// Sizes with an instance id of so many bytes, at most 255.
inline constexpr std::size_t kMaxInstanceIdBytes = 255;
constexpr std::size_t PlayerCredentialBytes(std::size_t id_bytes) { return 2 + id_bytes + 4 + 8 + 32 + 64; }
constexpr std::size_t WorkerCertificateBytes(std::size_t id_bytes) { return 2 + id_bytes + 4 + 8 + 32 + 64; }
inline constexpr std::size_t kMaxCredentialBytes = WorkerCertificateBytes(kMaxInstanceIdBytes);

std::vector<std::uint8_t> Sign(const PlayerCredential& credential, const SigningKey& instance_key);
std::vector<std::uint8_t> Sign(const WorkerCertificate& certificate, const SigningKey& instance_key);
// With a new key pair for the player.
Credentials IssuePlayer(std::string_view instance_id, PlayerNumber player, Generation generation,
                        const SigningKey& instance_key);

// Errors: UNAUTHENTICATED (damaged, of another kind, or not signed by that key in this protocol), NOT_FOUND (another
// instance; both are named).
absl::StatusOr<PlayerCredential> ReadPlayerCredential(std::span<const std::uint8_t> bytes, std::string_view instance_id,
                                                      const VerificationKey& instance_key);
absl::StatusOr<WorkerCertificate> ReadWorkerCertificate(std::span<const std::uint8_t> bytes,
                                                        std::string_view instance_id,
                                                        const VerificationKey& instance_key);

}  // namespace tessera::net
