#include "control_plane/secrets.h"

#include <sodium.h>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"

namespace tessera::control {
namespace {

constexpr std::size_t kSecretBytes = 32, kSerialBytes = 16;

}  // namespace

std::string SystemRandomBytes(std::size_t n) {
  std::string bytes(n, '\0');
  randombytes_buf(bytes.data(), n);
  return bytes;
}

std::string MakeJoinToken(const RandomBytes& random) {
  return absl::StrCat("tsj_", absl::BytesToHexString(random(kSecretBytes)));
}

std::string MakeHostSecret(const RandomBytes& random) {
  return absl::StrCat("tsh_", absl::BytesToHexString(random(kSecretBytes)));
}

std::string MakeAccessSecret(const RandomBytes& random) {
  return absl::StrCat("tsa_", absl::BytesToHexString(random(kSecretBytes)));
}

std::string MakeSerial(const RandomBytes& random) {
  std::string bytes = random(kSerialBytes);
  bytes.front() = static_cast<char>((bytes.front() & 0x7f) | 0x10);  // positive, and in one spelling
  return absl::BytesToHexString(bytes);
}

std::string HashSecret(std::string_view secret) {
  std::string hash(crypto_generichash_BYTES, '\0');
  crypto_generichash(reinterpret_cast<unsigned char*>(hash.data()), hash.size(),
                     reinterpret_cast<const unsigned char*>(secret.data()), secret.size(), nullptr, 0);
  return hash;
}

bool HashMatches(std::string_view hash, std::string_view stored) {
  return !hash.empty() && hash.size() == stored.size() && sodium_memcmp(hash.data(), stored.data(), hash.size()) == 0;
}

bool SecretMatches(std::string_view secret, std::string_view stored) {
  return secret.size() <= kMaxSecretBytes && HashMatches(HashSecret(secret), stored);
}

}  // namespace tessera::control
