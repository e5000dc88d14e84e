#include "trust/ticket_key.h"

#include <openssl/pem.h>

#include "trust/openssl_handles.h"

namespace tessera::trust {
namespace {

constexpr std::size_t kMaxTicketPemBytes = 4096;

absl::StatusOr<KeyHandle> TicketKeyFrom(const std::string& pem) {
  if (pem.size() > kMaxTicketPemBytes) {
    return absl::InvalidArgumentError(absl::StrCat("key: more than ", kMaxTicketPemBytes, " bytes"));
  }
  KeyHandle key = PrivateKeyIn(pem);
  if (!key) key.reset(PEM_read_bio_PUBKEY(ReadFrom(pem).get(), nullptr, NoPassphrase, nullptr));
  ERR_clear_error();
  if (!key) return absl::InvalidArgumentError("key: is no PEM of a key");
  if (EVP_PKEY_get_base_id(key.get()) != EVP_PKEY_ED25519) {
    return absl::InvalidArgumentError("key: is not an Ed25519 key; make one with `tessera issuer create`");
  }
  return key;
}

}  // namespace

absl::StatusOr<std::string> TicketKeyPem(const TicketSeed& seed) {
  const KeyHandle key(EVP_PKEY_new_raw_private_key(EVP_PKEY_ED25519, nullptr, seed.data(), seed.size()));
  const BioHandle bio(BIO_new(BIO_s_mem()));
  if (!key || !bio || PEM_write_bio_PKCS8PrivateKey(bio.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) != 1) {
    return OpensslFault("key cannot be written");
  }
  return TextOf(bio.get());
}

absl::StatusOr<std::string> TicketPublicKeyPem(const TicketPublicKey& public_key) {
  const KeyHandle key(EVP_PKEY_new_raw_public_key(EVP_PKEY_ED25519, nullptr, public_key.data(), public_key.size()));
  const BioHandle bio(BIO_new(BIO_s_mem()));
  if (!key || !bio || PEM_write_bio_PUBKEY(bio.get(), key.get()) != 1) return OpensslFault("key cannot be written");
  return TextOf(bio.get());
}

absl::StatusOr<TicketSeed> ReadTicketKey(const std::string& pem) {
  const auto key = TicketKeyFrom(pem);
  if (!key.ok()) return key.status();
  TicketSeed seed{};
  std::size_t size = seed.size();
  if (EVP_PKEY_get_raw_private_key(key->get(), seed.data(), &size) != 1 || size != seed.size()) {
    ERR_clear_error();
    return absl::InvalidArgumentError("key: is a public key; tickets are signed with the private one");
  }
  return seed;
}

absl::StatusOr<TicketPublicKey> ReadTicketPublicKey(const std::string& pem) {
  const auto key = TicketKeyFrom(pem);
  if (!key.ok()) return key.status();
  TicketPublicKey out{};
  std::size_t size = out.size();
  if (EVP_PKEY_get_raw_public_key(key->get(), out.data(), &size) != 1 || size != out.size()) {
    return OpensslFault("key cannot be read");
  }
  return out;
}

}  // namespace tessera::trust
