#include "net/signing_key.h"

#include <sodium.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/world/bytes.h"
#include "net/protocol.h"

namespace tessera::net {
namespace {

static_assert(kKeyBytes == crypto_sign_SEEDBYTES && kKeyBytes == crypto_sign_PUBLICKEYBYTES);
static_assert(Secret<64>::size() == crypto_sign_SECRETKEYBYTES && sizeof(Signature) == crypto_sign_BYTES);

absl::Status WrongSize(std::string_view bytes, const char* field) {
  return absl::InvalidArgumentError(absl::StrCat(field, " has ", bytes.size(), " bytes; it needs ", kKeyBytes));
}

std::vector<std::uint8_t> Labelled(std::string_view label, std::span<const std::uint8_t> bytes) {
  assert(label.size() <= 255);
  ByteWriter out;
  out.Reserve(1 + label.size() + 4 + bytes.size());
  out.U8(static_cast<std::uint8_t>(label.size()));
  out.Text(label);
  out.U32(kProtocolVersion);
  out.Bytes(bytes);
  return out.Take();
}

}  // namespace

void InitializeSodium() {
  static const int initialized = sodium_init();
  assert(initialized >= 0);
  (void)initialized;
}

SigningKey SigningKey::Make() {
  InitializeSodium();
  Seed seed;
  randombytes_buf(seed.data(), seed.size());
  return SigningKey(seed);
}

SigningKey::SigningKey(const Seed& seed) {
  InitializeSodium();
  crypto_sign_seed_keypair(verification_key_.data(), secret_.data(), seed.data());
}

absl::StatusOr<SigningKey> SigningKey::FromSeed(std::string_view seed, const char* field) {
  if (seed.size() != kKeyBytes) return WrongSize(seed, field);
  Seed bytes;
  std::memcpy(bytes.data(), seed.data(), bytes.size());
  return SigningKey(bytes);
}

Seed SigningKey::seed() const {
  Seed seed;
  std::copy_n(secret_.data(), seed.size(), seed.data());
  return seed;
}

Signature SigningKey::Sign(std::string_view label, std::span<const std::uint8_t> bytes) const {
  const std::vector<std::uint8_t> message = Labelled(label, bytes);
  Signature signature;
  crypto_sign_detached(signature.data(), nullptr, message.data(), message.size(), secret_.data());
  return signature;
}

absl::StatusOr<VerificationKey> VerificationKeyFrom(std::string_view bytes, const char* field) {
  if (bytes.size() != kKeyBytes) return WrongSize(bytes, field);
  VerificationKey key;
  std::memcpy(key.data(), bytes.data(), key.size());
  return key;
}

bool Verifies(const VerificationKey& by, std::string_view label, std::span<const std::uint8_t> bytes,
              std::span<const std::uint8_t, 64> signature) {
  InitializeSodium();
  const std::vector<std::uint8_t> message = Labelled(label, bytes);
  return crypto_sign_verify_detached(signature.data(), message.data(), message.size(), by.data()) == 0;
}

}  // namespace tessera::net
