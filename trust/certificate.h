// Certificates of a cluster's own authority: made, signed and read here, checked by gRPC.
//
// Keys are ECDSA P-256. A certificate never runs out: who is let in is decided by what the control plane's store says
// of its serial number, so that a machine whose clock is a year off stays in, and one that was removed is out at once.
// The control plane's certificates are issued to kControlName, and whoever dials it expects that name, whatever the
// address: the authority signs nobody else under it.
//
// Thread rule: free functions on values. All text is PEM.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace tessera::trust {

inline constexpr char kControlName[] = "control.tessera.internal";
inline constexpr std::size_t kMaxPemBytes = 8192;

struct KeyedCertificate {
  std::string certificate;
  std::string key;  // secret
};

// A new authority, signed by itself.
absl::StatusOr<KeyedCertificate> MakeAuthority();
// A certificate for `common_name`, with a new key. `serial`: 1 to 20 bytes as hexadecimal digits.
absl::StatusOr<KeyedCertificate> IssueServer(const KeyedCertificate& authority, const std::string& serial);

// A new key.
absl::StatusOr<std::string> MakeKey();
// A request (PKCS #10) for a certificate of this key, which it proves to be held.
absl::StatusOr<std::string> MakeRequest(const std::string& key);
// INVALID_ARGUMENT unless it is a request, signed with its own key, of a kind that the authority signs.
absl::Status CheckRequest(const std::string& request);
// A certificate of a client named `common_name`, for the key of the request; what else that asks for is ignored.
absl::StatusOr<std::string> IssueClient(const KeyedCertificate& authority, const std::string& request,
                                        const std::string& common_name, const std::string& serial);

struct CertificateFacts {
  std::string common_name;
  std::string serial;       // hexadecimal, lower case, without leading zeros
  std::string fingerprint;  // SHA-256 of the certificate, 64 hexadecimal digits in lower case
};
// INVALID_ARGUMENT if it cannot be read.
absl::StatusOr<CertificateFacts> ReadCertificate(const std::string& certificate);

// The key under a passphrase, and back. PERMISSION_DENIED: it is another passphrase's.
absl::StatusOr<std::string> EncryptKey(const std::string& key, const std::string& passphrase);
absl::StatusOr<std::string> DecryptKey(const std::string& encrypted, const std::string& passphrase);

bool IsFingerprint(const std::string& text);

}  // namespace tessera::trust
