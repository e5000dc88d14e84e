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

// `seal_path`: the file with the passphrase of the key. Both are made where neither is there. FAILED_PRECONDITION: the
// store has an authority and the file is missing or another's; without it nobody can sign for this cluster.
absl::StatusOr<Authority> OpenAuthority(Store& store, const std::string& seal_path, const RandomBytes& random);

}  // namespace tessera::control
