// Key files of ticket issuers: Ed25519 as PEM, as `openssl genpkey -algorithm ed25519` writes them.
//
//   const std::string file = *TicketKeyPem(seed);   // "-----BEGIN PRIVATE KEY-----", secret
//   ReadTicketKey(file) == seed
//
// Thread rule: free functions on values.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "trust/ticket.h"

namespace tessera::trust {

absl::StatusOr<std::string> TicketKeyPem(const TicketSeed& seed);
absl::StatusOr<std::string> TicketPublicKeyPem(const TicketPublicKey& key);

// INVALID_ARGUMENT: no PEM, or of another kind of key. A private key has its public half, so either file gives that.
absl::StatusOr<TicketSeed> ReadTicketKey(const std::string& pem);
absl::StatusOr<TicketPublicKey> ReadTicketPublicKey(const std::string& pem);

}  // namespace tessera::trust
