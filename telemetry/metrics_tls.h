// By which certificate a process serves its metrics, and whom it lets ask.
//
//   auto tls = ReadMetricsTls({.certificate = "/etc/tessera/metrics.pem", .key = "/etc/tessera/metrics.key"});
//   if (!tls.ok()) return tls.status();
//   auto server = MetricsServer::Start("10.0.0.7", 7702, registry, token, *tls);
//
// Thread rule: free functions on values.
#pragma once

#include <openssl/types.h>

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::telemetry {

// Files, PEM, as options name them; all empty: plain HTTP.
struct MetricsTlsFiles {
  std::string certificate;       // the server's own first, then what leads to a known authority
  std::string key;               // secret; without a passphrase
  std::string client_authority;  // empty: whoever connects may ask
};

// Declares the options of a program; `App` is CLI::App.
template <class App>
void AddMetricsTlsOptions(App& app, MetricsTlsFiles& files) {
  app.add_option("--metrics-tls-cert", files.certificate,
                 "PEM file with the certificate, and its chain, that the metrics are served by; default none: they are "
                 "served as plain HTTP");
  app.add_option("--metrics-tls-key", files.key, "PEM file with that certificate's key");
  app.add_option("--metrics-tls-client-ca", files.client_authority,
                 "PEM file with the authorities whose clients alone may connect there; default none: whoever does");
}

// Their content.
struct MetricsTls {
  std::string certificate, key, client_authority;
  bool used() const { return !certificate.empty(); }
};

// INVALID_ARGUMENT "--metrics-tls-cert PATH: ...": a file cannot be read or is not what it should be, the key is not
// the certificate's, or one of the two is missing.
absl::StatusOr<MetricsTls> ReadMetricsTls(const MetricsTlsFiles& files);

// Makes the context of a server speak TLS 1.2 and later by them, and demand a client's certificate where there is an
// authority for these. INVALID_ARGUMENT: as above.
absl::Status SetMetricsTls(SSL_CTX* context, const MetricsTls& tls);

}  // namespace tessera::telemetry
