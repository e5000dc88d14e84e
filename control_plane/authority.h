// The cluster's authority: made once, kept in the store with its key encrypted, opened at each start.
//
// Thread rule: free functions on values.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "control_plane/secrets.h"
#include "control_plane/store.h"
#include "trust/certificate.h"

namespace tessera::control {

struct Authority {
  trust::KeyedCertificate signer;
  std::string fingerprint;
};

inline constexpr char kAuthorityKey[] = "authority";  // in the store

// `seal_path`: the file with the passphrase of the key. FAILED_PRECONDITION: the file is missing or another's; without
// it nobody can sign for this cluster. `OpenAuthority` makes both where neither is there.
absl::StatusOr<Authority> ReadAuthority(const std::string& stored, const std::string& seal_path);
absl::StatusOr<Authority> OpenAuthority(Store& store, const std::string& seal_path, const RandomBytes& random);

}  // namespace tessera::control
