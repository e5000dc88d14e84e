// The certificate that a server of pages shows: a chain, its own first, and its key, both PEM; and how such files are
// read.
//
//   auto certificate = ReadServerCertificate({"--certificate", flags.certificate}, {"--key", flags.key});
//   if (absl::Status status = CheckServerCertificate(*certificate, "--certificate"); !status.ok()) return status;
//   ... in the server's context, once it is there: LoadServerCertificate(context, *certificate, "--certificate")
//
// INVALID_ARGUMENT: "--certificate: ...", with OpenSSL's words. Thread rule: free functions.
#pragma once

#include <openssl/types.h>

#include <cstddef>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::trust {

// A chain of a few certificates has some 10 KiB, a list of all authorities of a system 220.
inline constexpr std::size_t kMaxPemFileBytes = std::size_t{256} << 10;

struct PemOption {
  std::string option, path;
};

// The text of a file. INVALID_ARGUMENT "--key PATH: No such file or directory", "--key PATH is no PEM file".
absl::StatusOr<std::string> ReadPemFile(const PemOption& file);

struct ServerCertificate {
  std::string chain;
  std::string key;  // secret; without a passphrase
};

// Errors are those of ReadPemFile.
absl::StatusOr<ServerCertificate> ReadServerCertificate(const PemOption& chain, const PemOption& key);
// From then on the context speaks TLS 1.2 and later. `key_name`: of the key in errors; empty: `name`.
absl::Status LoadServerCertificate(SSL_CTX* context, const ServerCertificate& certificate, const std::string& name,
                                   const std::string& key_name = "");
// Whether it could be loaded.
absl::Status CheckServerCertificate(const ServerCertificate& certificate, const std::string& name);

}  // namespace tessera::trust
