// The certificate that a server of web pages shows: a chain, its own first, and its key, both PEM.
//
//   if (absl::Status status = CheckServerCertificate(certificate, "--certificate"); !status.ok()) return status;
//   ... in the server's context, once it is there: LoadServerCertificate(context, certificate, "--certificate")
//
// INVALID_ARGUMENT: "--certificate: ...", with OpenSSL's words. Thread rule: free functions.
#pragma once

#include <openssl/ssl.h>

#include <string>

#include "absl/status/status.h"

namespace tessera::trust {

struct ServerCertificate {
  std::string chain;
  std::string key;  // secret; without a passphrase
};

// From then on the context speaks TLS 1.2 and later.
absl::Status LoadServerCertificate(SSL_CTX* context, const ServerCertificate& certificate, const std::string& name);
// Whether it could be loaded.
absl::Status CheckServerCertificate(const ServerCertificate& certificate, const std::string& name);

}  // namespace tessera::trust
