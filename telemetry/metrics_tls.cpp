#include "telemetry/metrics_tls.h"

#include <openssl/ssl.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "trust/openssl_handles.h"
#include "trust/server_certificate.h"

namespace tessera::telemetry {
namespace {

constexpr char kCertOption[] = "--metrics-tls-cert", kKeyOption[] = "--metrics-tls-key",
               kAuthorityOption[] = "--metrics-tls-client-ca";

absl::Status ClientsFault(const char* what) {
  return absl::InvalidArgumentError(absl::StrCat(kAuthorityOption, ": ", what, ": ", trust::TakeOpensslError()));
}

absl::Status SetClients(SSL_CTX* context, const std::string& authorities) {
  const trust::BioHandle text = trust::ReadFrom(authorities);
  int taken = 0;
  while (const trust::CertificateHandle authority = trust::NextCertificate(text.get())) {
    if (X509_STORE_add_cert(SSL_CTX_get_cert_store(context), authority.get()) != 1 ||
        SSL_CTX_add_client_CA(context, authority.get()) != 1) {
      return ClientsFault("a certificate cannot be used");
    }
    ++taken;
  }
  if (taken == 0) return ClientsFault("there is no certificate in it");
  ERR_clear_error();  // the end of the file is one to OpenSSL
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MetricsTls> ReadMetricsTls(const MetricsTlsFiles& files) {
  if (files.certificate.empty() != files.key.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(kCertOption, " and ", kKeyOption, " are given together"));
  }
  if (files.certificate.empty() && !files.client_authority.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(kAuthorityOption, ": needs ", kCertOption));
  }
  if (files.certificate.empty()) return MetricsTls{};
  auto own = trust::ReadServerCertificate({kCertOption, files.certificate}, {kKeyOption, files.key});
  if (!own.ok()) return own.status();
  MetricsTls tls{.certificate = std::move(own->chain), .key = std::move(own->key), .client_authority = {}};
  if (!files.client_authority.empty()) {
    auto authority = trust::ReadPemFile({kAuthorityOption, files.client_authority});
    if (!authority.ok()) return authority.status();
    tls.client_authority = *std::move(authority);
  }
  const trust::TlsContextHandle context(SSL_CTX_new(TLS_server_method()));
  if (!context) return trust::OpensslFault("TLS cannot be used");
  if (absl::Status status = SetMetricsTls(context.get(), tls); !status.ok()) return status;
  return tls;
}

absl::Status SetMetricsTls(SSL_CTX* context, const MetricsTls& tls) {
  // One request a connection: there is nothing to resume.
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(context, SSL_OP_NO_TICKET);
  const trust::ServerCertificate own{.chain = tls.certificate, .key = tls.key};
  if (absl::Status status = trust::LoadServerCertificate(context, own, kCertOption, kKeyOption); !status.ok()) {
    return status;
  }
  return tls.client_authority.empty() ? absl::OkStatus() : SetClients(context, tls.client_authority);
}

}  // namespace tessera::telemetry
