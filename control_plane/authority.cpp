#include "control_plane/authority.h"

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "control_plane/control_records.pb.h"
#include "host/files.h"

namespace tessera::control {
namespace {

constexpr std::size_t kPassphraseBytes = 32, kMaxSealBytes = 256;

absl::StatusOr<Authority> With(trust::KeyedCertificate signer) {
  const auto facts = trust::ReadCertificate(signer.certificate);
  if (!facts.ok()) return facts.status();
  return Authority{std::move(signer), facts->fingerprint};
}

absl::StatusOr<std::string> ReadSeal(const std::string& path) {
  auto text = host::ReadFile(path, kMaxSealBytes);
  if (!text.ok()) return text.status();
  absl::StripAsciiWhitespace(&*text);
  return text;
}

// A seal whose authority was never stored, because somebody ended us in between, is used for the next.
absl::StatusOr<std::string> ReadOrMakeSeal(const std::string& path, const RandomBytes& random) {
  auto seal = ReadSeal(path);
  if (!absl::IsNotFound(seal.status())) return seal;
  seal = absl::BytesToHexString(random(kPassphraseBytes));
  const absl::Status written = host::WriteFile(path, *seal + "\n", host::Durability::kSurvivesMachine);
  if (!written.ok()) return written;
  return seal;
}

absl::StatusOr<Authority> MakeStored(Store& store, const std::string& seal_path, const RandomBytes& random) {
  auto made = trust::MakeAuthority();
  if (!made.ok()) return made.status();
  const auto seal = ReadOrMakeSeal(seal_path, random);
  if (!seal.ok()) return seal.status();
  auto encrypted = trust::EncryptKey(made->key, *seal);
  if (!encrypted.ok()) return encrypted.status();
  records::Authority record;
  record.set_certificate(made->certificate);
  record.set_encrypted_key(*std::move(encrypted));
  if (const auto put = store.Put(kAuthorityKey, record.SerializeAsString(), kAbsent); !put.ok()) return put.status();
  return With(*std::move(made));
}

}  // namespace

absl::StatusOr<Authority> OpenAuthority(Store& store, const std::string& seal_path, const RandomBytes& random) {
  const auto stored = store.Get(kAuthorityKey);
  if (absl::IsNotFound(stored.status())) return MakeStored(store, seal_path, random);
  if (!stored.ok()) return stored.status();
  return ReadAuthority(stored->value, seal_path);
}

absl::StatusOr<Authority> ReadAuthority(const std::string& stored, const std::string& seal_path) {
  records::Authority record;
  if (!record.ParseFromString(stored)) return absl::DataLossError("store: authority: cannot be read");
  const auto seal = ReadSeal(seal_path);
  if (!seal.ok()) {
    return absl::FailedPreconditionError(
        absl::StrCat("the key of the cluster's authority cannot be opened: ", seal.status().message(),
                     "; put the file back from a backup, or copy that of another control plane of this "
                     "cluster"));
  }
  auto key = trust::DecryptKey(record.encrypted_key(), *seal);
  if (!key.ok()) {
    return absl::FailedPreconditionError(absl::StrCat(
        seal_path, " does not open the key of this cluster's authority; put the file back that belongs to it"));
  }
  return With({record.certificate(), *std::move(key)});
}

}  // namespace tessera::control
