// The list of revocations on its way: signed by the cluster's key, of a bounded size.
//
// Hosts that were removed, lives of regions that evicted hosts ran, and players' bans are one list with a number that
// only grows. The control plane signs it; agents verify it and keep the newest. Whoever has the public key alone can
// make none, so a list that comes back from a host is as good as the store.
//
//   const auto list = SignRevocations(content, key);                       // the control plane
//   const auto content = ReadRevocations(*list, key.verification_key());   // an agent, or the control plane again
//
// Thread rule: free functions on values. Errors name "revocations".
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "net/signing_key.h"
#include "tessera/v1/revocations.pb.h"

namespace tessera::trust {

// Every change of the list goes to every host, and is a value of the store (etcd takes 1.5 MiB): some 10 000 bans with
// short reasons, or 40 000 lives of regions. Larger, and a ban costs a large cluster gigabytes.
inline constexpr std::size_t kMaxRevocationBytes = std::size_t{1} << 20;
inline constexpr std::size_t kSealNonceBytes = 24;

// RESOURCE_EXHAUSTED says how room is made.
absl::StatusOr<v1::SignedRevocations> SignRevocations(const v1::Revocations& content, const net::SigningKey& key);
// INVALID_ARGUMENT: too large, or no list. UNAUTHENTICATED: not signed by that key. Nothing is verified that is too
// large.
absl::StatusOr<v1::Revocations> ReadRevocations(const v1::SignedRevocations& list, const net::VerificationKey& key);

// Bytes that only the holder of the key can read (XSalsa20-Poly1305). `nonce`: kSealNonceBytes that are used once.
std::string SealFor(const net::SigningKey& key, std::string_view plain, std::string_view nonce);
// DATA_LOSS: not sealed for that key, or damaged.
absl::StatusOr<std::string> Unseal(const net::SigningKey& key, std::string_view sealed);

}  // namespace tessera::trust
