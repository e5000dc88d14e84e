#include "net/connect_token.h"

#include <sodium.h>

#include <cassert>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "net/protocol.h"

namespace tessera::net {
namespace {

// Sealed: nonce (24) | the instance id it is for, its length first (2 + n) | ciphertext of player (4) and expiry (8),
// tag (16). The instance id travels in the clear, authenticated, so that a token for another instance can be named as
// such.
constexpr std::size_t kNonceBytes = crypto_aead_xchacha20poly1305_ietf_NPUBBYTES;
constexpr std::size_t kTagBytes = crypto_aead_xchacha20poly1305_ietf_ABYTES;
constexpr std::size_t kSecretBytes = 4 + 8;
constexpr std::size_t kMaxInstanceIdBytes = 255;
constexpr std::size_t kProofBytes = 32;
static_assert(crypto_aead_xchacha20poly1305_ietf_KEYBYTES == kInstanceKeyBytes);
static_assert(kProofBytes >= crypto_generichash_BYTES_MIN && kProofBytes <= crypto_generichash_BYTES_MAX);

void InitializeSodium() {
  static const int initialized = sodium_init();
  assert(initialized >= 0);
  (void)initialized;
}

template <class T>
void AppendLittleEndian(std::vector<std::uint8_t>& out, T value) {
  for (std::size_t i = 0; i < sizeof value; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

template <class T>
T ReadLittleEndian(const std::uint8_t* from) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof value; ++i) value = static_cast<T>(value | static_cast<T>(from[i]) << (8 * i));
  return value;
}

std::vector<std::uint8_t> AssociatedData(std::string_view instance_id) {
  std::vector<std::uint8_t> data;
  for (const char c : std::string_view("tessera connect token")) data.push_back(static_cast<std::uint8_t>(c));
  AppendLittleEndian(data, kProtocolVersion);
  data.insert(data.end(), instance_id.begin(), instance_id.end());
  return data;
}

}  // namespace

InstanceKey MakeInstanceKey() {
  InitializeSodium();
  InstanceKey key;
  randombytes_buf(key.data(), key.size());
  return key;
}

absl::StatusOr<InstanceKey> InstanceKeyFrom(std::string_view bytes) {
  if (bytes.size() != kInstanceKeyBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("instance_key has ", bytes.size(), " bytes; it needs ", kInstanceKeyBytes));
  }
  InstanceKey key;
  std::memcpy(key.data(), bytes.data(), key.size());
  return key;
}

std::vector<std::uint8_t> Seal(const ConnectToken& token, const InstanceKey& key) {
  InitializeSodium();
  assert(token.instance_id.size() <= kMaxInstanceIdBytes);
  std::vector<std::uint8_t> sealed(kNonceBytes);
  randombytes_buf(sealed.data(), kNonceBytes);
  AppendLittleEndian(sealed, static_cast<std::uint16_t>(token.instance_id.size()));
  sealed.insert(sealed.end(), token.instance_id.begin(), token.instance_id.end());

  std::vector<std::uint8_t> secret;
  AppendLittleEndian(secret, token.player.value());
  AppendLittleEndian(secret, token.expires_unix_s);
  assert(secret.size() == kSecretBytes);
  const std::vector<std::uint8_t> associated = AssociatedData(token.instance_id);
  const std::size_t head_bytes = sealed.size();
  sealed.resize(head_bytes + kSecretBytes + kTagBytes);
  crypto_aead_xchacha20poly1305_ietf_encrypt(sealed.data() + head_bytes, nullptr, secret.data(), secret.size(),
                                             associated.data(), associated.size(), nullptr, sealed.data(), key.data());
  return sealed;
}

absl::StatusOr<ConnectToken> Open(std::span<const std::uint8_t> sealed, const std::string& instance_id,
                                  const InstanceKey& key, std::uint64_t now_unix_s) {
  InitializeSodium();
  const absl::Status damaged = absl::UnauthenticatedError("connect token is damaged, or of another key or protocol");
  if (sealed.size() < kNonceBytes + 2) return damaged;
  const auto id_bytes = ReadLittleEndian<std::uint16_t>(sealed.data() + kNonceBytes);
  const std::size_t head_bytes = kNonceBytes + 2 + id_bytes;
  if (id_bytes > kMaxInstanceIdBytes || sealed.size() != head_bytes + kSecretBytes + kTagBytes) return damaged;

  ConnectToken token;
  token.instance_id.assign(reinterpret_cast<const char*>(sealed.data()) + kNonceBytes + 2, id_bytes);
  // Each instance has a key of its own, so another instance's token does not open here; its name is only a hint for the
  // error.
  if (token.instance_id != instance_id) {
    return absl::NotFoundError(
        absl::StrCat("connect token is for instance ", token.instance_id, ", this is ", instance_id));
  }
  const std::vector<std::uint8_t> associated = AssociatedData(instance_id);
  std::uint8_t secret[kSecretBytes];
  if (crypto_aead_xchacha20poly1305_ietf_decrypt(secret, nullptr, nullptr, sealed.data() + head_bytes,
                                                 kSecretBytes + kTagBytes, associated.data(), associated.size(),
                                                 sealed.data(), key.data()) != 0) {
    return damaged;
  }
  token.player = PlayerNumber(ReadLittleEndian<std::uint32_t>(secret));
  token.expires_unix_s = ReadLittleEndian<std::uint64_t>(secret + 4);
  if (now_unix_s >= token.expires_unix_s) {
    return absl::DeadlineExceededError(
        absl::StrCat("connect token expired ", now_unix_s - token.expires_unix_s, " s ago"));
  }
  return token;
}

std::vector<std::uint8_t> LinkProof(const InstanceKey& key, const std::string& instance_id, RegionId region,
                                    Incarnation incarnation, MapVersion map_version) {
  InitializeSodium();
  std::vector<std::uint8_t> fields;
  AppendLittleEndian(fields, kProtocolVersion);
  AppendLittleEndian(fields, static_cast<std::uint32_t>(instance_id.size()));
  fields.insert(fields.end(), instance_id.begin(), instance_id.end());
  AppendLittleEndian(fields, region.value());
  AppendLittleEndian(fields, incarnation.value());
  AppendLittleEndian(fields, map_version.value());
  std::vector<std::uint8_t> proof(kProofBytes);
  crypto_generichash(proof.data(), proof.size(), fields.data(), fields.size(), key.data(), key.size());
  return proof;
}

}  // namespace tessera::net
