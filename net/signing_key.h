// SigningKey: an Ed25519 key pair. Who has it signs, who has its public half verifies and cannot sign.
//
// Each signature is over a label that says what is signed, the protocol's version and the bytes, so none passes for one
// of another kind or version. A pair is made from 32 random bytes, its seed.
//
//   const SigningKey key = SigningKey::Make();
//   Verifies(key.verification_key(), "tessera login", bytes, key.Sign("tessera login", bytes)) == true
//
// Thread rule: plain values.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "absl/status/statusor.h"
#include "net/secret.h"

namespace tessera::net {

inline constexpr std::size_t kKeyBytes = 32;  // for a seed, and for a public key
using Seed = Secret<kKeyBytes>;
using VerificationKey = std::array<std::uint8_t, kKeyBytes>;
using Signature = std::array<std::uint8_t, 64>;

class SigningKey {
 public:
  SigningKey() = default;  // nobody's: what it signs does not verify
  static SigningKey Make();
  explicit SigningKey(const Seed& seed);
  // `field` names it in errors: INVALID_ARGUMENT unless it has 32 bytes.
  static absl::StatusOr<SigningKey> FromSeed(std::string_view seed, const char* field);

  Seed seed() const;
  const VerificationKey& verification_key() const { return verification_key_; }
  // A label has at most 255 bytes.
  Signature Sign(std::string_view label, std::span<const std::uint8_t> bytes) const;

 private:
  Secret<64> secret_;  // as libsodium has it: the seed, then the public key
  VerificationKey verification_key_{};
};

// INVALID_ARGUMENT "FIELD has 31 bytes; it needs 32".
absl::StatusOr<VerificationKey> VerificationKeyFrom(std::string_view bytes, const char* field);

bool Verifies(const VerificationKey& by, std::string_view label, std::span<const std::uint8_t> bytes,
              std::span<const std::uint8_t, 64> signature);

// Starts libsodium, which every use of it needs; again does nothing.
void InitializeSodium();

}  // namespace tessera::net
