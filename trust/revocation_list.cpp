#include "trust/revocation_list.h"

#include <sodium.h>

#include <algorithm>
#include <cassert>
#include <span>

#include "absl/strings/str_cat.h"
#include "core/world/byte_view.h"
#include "net/secret.h"

namespace tessera::trust {
namespace {

constexpr std::string_view kRevocationsLabel = "tessera revocations";
constexpr std::string_view kBanSealLabel = "tessera bans";

static_assert(kSealNonceBytes == crypto_secretbox_NONCEBYTES);

// Apart from the key that signs: what is signed gives no hint of what is sealed.
net::Secret<crypto_secretbox_KEYBYTES> SealKey(const net::SigningKey& key) {
  net::InitializeSodium();
  const net::Seed seed = key.seed();
  net::Secret<crypto_secretbox_KEYBYTES> derived;
  const std::span<const std::uint8_t> label = AsBytes(kBanSealLabel);
  crypto_generichash(derived.data(), net::Secret<crypto_secretbox_KEYBYTES>::size(), label.data(), label.size(),
                     seed.data(), net::Seed::size());
  return derived;
}

std::uint8_t* Writable(std::string& text) { return reinterpret_cast<std::uint8_t*>(text.data()); }

}  // namespace

absl::StatusOr<v1::SignedRevocations> SignRevocations(const v1::Revocations& content, const net::SigningKey& key) {
  v1::SignedRevocations list;
  list.set_list(content.SerializeAsString());
  if (list.list().size() > kMaxRevocationBytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("revocations: the list would have ", list.list().size(), " bytes, at most ", kMaxRevocationBytes,
                     "; lift bans (tessera player unban), or end worlds that ran on evicted hosts"));
  }
  const net::Signature signature = key.Sign(kRevocationsLabel, AsBytes(list.list()));
  list.set_signature(std::string(signature.begin(), signature.end()));
  return list;
}

absl::StatusOr<v1::Revocations> ReadRevocations(const v1::SignedRevocations& list, const net::VerificationKey& key) {
  if (list.list().size() > kMaxRevocationBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("revocations.list: has ", list.list().size(), " bytes, at most ", kMaxRevocationBytes));
  }
  net::Signature signature{};
  if (list.signature().size() != signature.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("revocations.signature: has ", list.signature().size(), " bytes, not ", signature.size()));
  }
  std::ranges::copy(AsBytes(list.signature()), signature.begin());
  if (!net::Verifies(key, kRevocationsLabel, AsBytes(list.list()), signature)) {
    return absl::UnauthenticatedError("revocations.signature: is not of the cluster's key");
  }
  v1::Revocations content;
  if (!content.ParseFromString(list.list())) {
    return absl::InvalidArgumentError("revocations.list: cannot be read");
  }
  return content;
}

std::string SealFor(const net::SigningKey& key, std::string_view plain, std::string_view nonce) {
  assert(nonce.size() == kSealNonceBytes);
  const auto secret = SealKey(key);
  std::string sealed(nonce);
  sealed.resize(kSealNonceBytes + crypto_secretbox_MACBYTES + plain.size());
  crypto_secretbox_easy(Writable(sealed) + kSealNonceBytes, AsBytes(plain).data(), plain.size(), AsBytes(nonce).data(),
                        secret.data());
  return sealed;
}

absl::StatusOr<std::string> Unseal(const net::SigningKey& key, std::string_view sealed) {
  const absl::Status damaged = absl::DataLossError("revocations.sealed_bans: cannot be opened with the cluster's key");
  if (sealed.size() < kSealNonceBytes + crypto_secretbox_MACBYTES) return damaged;
  const auto secret = SealKey(key);
  std::string plain(sealed.size() - kSealNonceBytes - crypto_secretbox_MACBYTES, '\0');
  const std::span<const std::uint8_t> bytes = AsBytes(sealed);
  if (crypto_secretbox_open_easy(Writable(plain), bytes.data() + kSealNonceBytes, bytes.size() - kSealNonceBytes,
                                 bytes.data(), secret.data()) != 0) {
    return damaged;
  }
  return plain;
}

}  // namespace tessera::trust
