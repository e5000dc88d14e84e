#include "net/connect_token.h"

#include <sodium.h>

#include <cassert>
#include <cstring>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/world/bytes.h"
#include "net/protocol.h"

namespace tessera::net {
namespace {

// A sealed token: nonce (24), which is also the token's id | the instance id, its length first (2 + n) | ciphertext
// with player (4), region (4), incarnation (8) and expiry (8), tag (16). The instance id travels in the clear,
// authenticated, so that a token for another instance can be named as such.
constexpr std::size_t kNonceBytes = crypto_aead_xchacha20poly1305_ietf_NPUBBYTES;
constexpr std::size_t kTagBytes = crypto_aead_xchacha20poly1305_ietf_ABYTES;
constexpr std::size_t kSecretBytes = 4 + 4 + 8 + 8;
constexpr std::size_t kMaxInstanceIdBytes = 255;
static_assert(crypto_aead_xchacha20poly1305_ietf_KEYBYTES == kKeyBytes);
static_assert(kMaxTokenBytes == kNonceBytes + 2 + kMaxInstanceIdBytes + kSecretBytes + kTagBytes);

void InitializeSodium() {
  static const int initialized = sodium_init();
  assert(initialized >= 0);
  (void)initialized;
}

std::vector<std::uint8_t> AssociatedData(std::string_view instance_id) {
  ByteWriter data;
  data.Text("tessera connect token");
  data.U32(kProtocolVersion);
  data.Text(instance_id);
  return data.Take();
}

absl::StatusOr<Secret<kKeyBytes>> KeyFrom(std::string_view bytes, const char* field) {
  if (bytes.size() != kKeyBytes) {
    return absl::InvalidArgumentError(absl::StrCat(field, " has ", bytes.size(), " bytes; it needs ", kKeyBytes));
  }
  Secret<kKeyBytes> key;
  std::memcpy(key.data(), bytes.data(), key.size());
  return key;
}

}  // namespace

InstanceKey MakeInstanceKey() {
  InitializeSodium();
  InstanceKey key;
  randombytes_buf(key.data(), key.size());
  return key;
}

absl::StatusOr<InstanceKey> InstanceKeyFrom(std::string_view bytes) { return KeyFrom(bytes, "instance_key"); }
absl::StatusOr<SessionKey> SessionKeyFrom(std::string_view bytes) { return KeyFrom(bytes, "session_key"); }

std::vector<std::uint8_t> Seal(const ConnectToken& token, const InstanceKey& key) {
  InitializeSodium();
  assert(token.instance_id.size() <= kMaxInstanceIdBytes);
  std::array<std::uint8_t, kNonceBytes> nonce;
  randombytes_buf(nonce.data(), nonce.size());
  ByteWriter head;
  head.Bytes(nonce);
  head.U16(static_cast<std::uint16_t>(token.instance_id.size()));
  head.Text(token.instance_id);

  ByteWriter secret;
  secret.U32(token.player.value());
  secret.U32(token.region.value());
  secret.U64(token.incarnation.value());
  secret.U64(token.expires_unix_s);
  assert(secret.size() == kSecretBytes);
  const std::vector<std::uint8_t> associated = AssociatedData(token.instance_id);
  std::vector<std::uint8_t> sealed = head.Take();
  const std::size_t head_bytes = sealed.size();
  sealed.resize(head_bytes + kSecretBytes + kTagBytes);
  crypto_aead_xchacha20poly1305_ietf_encrypt(sealed.data() + head_bytes, nullptr, secret.bytes().data(), secret.size(),
                                             associated.data(), associated.size(), nullptr, sealed.data(), key.data());
  return sealed;
}

SessionKey SessionKeyOf(std::span<const std::uint8_t> sealed, const InstanceKey& key) {
  assert(sealed.size() >= kNonceBytes);
  ByteWriter input;
  input.Text("tessera session key");
  input.U32(kProtocolVersion);
  input.Bytes(sealed.first(kNonceBytes));
  SessionKey session;
  crypto_generichash(session.data(), session.size(), input.bytes().data(), input.size(), key.data(), key.size());
  return session;
}

Credentials Issue(const ConnectToken& token, const InstanceKey& key) {
  Credentials credentials{.token = Seal(token, key), .key = {}};
  credentials.key = SessionKeyOf(credentials.token, key);
  return credentials;
}

absl::StatusOr<ConnectToken> Open(std::span<const std::uint8_t> sealed, const std::string& instance_id,
                                  const InstanceKey& key, std::uint64_t now_unix_s) {
  InitializeSodium();
  const absl::Status damaged = absl::UnauthenticatedError("connect token is damaged, or of another key or protocol");
  ByteReader reader(sealed);
  const std::span<const std::uint8_t> nonce = reader.Bytes(kNonceBytes);
  const auto id_bytes = reader.U16();
  const std::span<const std::uint8_t> id = reader.Bytes(id_bytes);
  const std::span<const std::uint8_t> ciphertext = reader.rest();
  if (!reader.ok() || id_bytes > kMaxInstanceIdBytes || ciphertext.size() != kSecretBytes + kTagBytes) return damaged;

  ConnectToken token;
  token.instance_id.assign(id.begin(), id.end());
  // Each instance has a key of its own, so another instance's token does not open here; its name is only a hint for the
  // error.
  if (token.instance_id != instance_id) {
    return absl::NotFoundError(absl::StrCat("connect token is for instance ",
                                            absl::CHexEscape(token.instance_id.substr(0, 64)), ", this is ",
                                            instance_id));
  }
  const std::vector<std::uint8_t> associated = AssociatedData(instance_id);
  std::array<std::uint8_t, kSecretBytes> secret;
  if (crypto_aead_xchacha20poly1305_ietf_decrypt(secret.data(), nullptr, nullptr, ciphertext.data(), ciphertext.size(),
                                                 associated.data(), associated.size(), nonce.data(), key.data()) != 0) {
    return damaged;
  }
  ByteReader fields(secret);
  token.player = PlayerNumber(fields.U32());
  token.region = RegionId(fields.U32());
  token.incarnation = Incarnation(fields.U64());
  token.expires_unix_s = fields.U64();
  if (now_unix_s >= token.expires_unix_s) {
    return absl::DeadlineExceededError(
        absl::StrCat("connect token expired ", now_unix_s - token.expires_unix_s, " s ago"));
  }
  return token;
}

}  // namespace tessera::net
