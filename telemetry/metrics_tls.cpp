#include "telemetry/metrics_tls.h"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>

#include <cstddef>
#include <memory>

#include "absl/strings/str_cat.h"
#include "host/files.h"

namespace tessera::telemetry {
namespace {

constexpr std::size_t kMaxMetricsPemBytes = std::size_t{256} << 10;
constexpr char kCertOption[] = "--metrics-tls-cert", kKeyOption[] = "--metrics-tls-key",
               kAuthorityOption[] = "--metrics-tls-client-ca";

template <auto kFree>
struct FreeBy {
  template <class T>
  void operator()(T* value) const {
    kFree(value);
  }
};
using PemReader = std::unique_ptr<BIO, FreeBy<BIO_free>>;
using PemCertificate = std::unique_ptr<X509, FreeBy<X509_free>>;
using PemKey = std::unique_ptr<EVP_PKEY, FreeBy<EVP_PKEY_free>>;
using ServerContext = std::unique_ptr<SSL_CTX, FreeBy<SSL_CTX_free>>;

PemReader ReaderOf(const std::string& text) {
  return PemReader(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

absl::Status TlsFault(const char* option, const char* what) {
  char reason[256] = "";
  if (const unsigned long error = ERR_get_error(); error != 0) ERR_error_string_n(error, reason, sizeof reason);
  ERR_clear_error();
  return absl::InvalidArgumentError(absl::StrCat(option, ": ", what, *reason == 0 ? "" : ": ", reason));
}

absl::Status SetOwn(SSL_CTX* context, const MetricsTls& tls) {
  const PemReader chain = ReaderOf(tls.certificate);
  const PemCertificate own(PEM_read_bio_X509(chain.get(), nullptr, nullptr, nullptr));
  if (!own || SSL_CTX_use_certificate(context, own.get()) != 1) {
    return TlsFault(kCertOption, "the certificate cannot be read");
  }
  while (X509* next = PEM_read_bio_X509(chain.get(), nullptr, nullptr, nullptr)) {
    if (SSL_CTX_add0_chain_cert(context, next) == 1) continue;
    X509_free(next);
    return TlsFault(kCertOption, "the certificate's chain cannot be read");
  }
  ERR_clear_error();  // the end of the file is one to OpenSSL
  const auto no_passphrase = [](char*, int, int, void*) { return 0; };
  const PemKey key(PEM_read_bio_PrivateKey(ReaderOf(tls.key).get(), nullptr, no_passphrase, nullptr));
  if (!key || SSL_CTX_use_PrivateKey(context, key.get()) != 1 || SSL_CTX_check_private_key(context) != 1) {
    return TlsFault(kKeyOption, "the key cannot be read, or is not the certificate's");
  }
  return absl::OkStatus();
}

absl::Status SetClients(SSL_CTX* context, const std::string& authorities) {
  const PemReader reader = ReaderOf(authorities);
  int taken = 0;
  while (const PemCertificate authority{PEM_read_bio_X509(reader.get(), nullptr, nullptr, nullptr)}) {
    if (X509_STORE_add_cert(SSL_CTX_get_cert_store(context), authority.get()) != 1 ||
        SSL_CTX_add_client_CA(context, authority.get()) != 1) {
      return TlsFault(kAuthorityOption, "a certificate cannot be used");
    }
    ++taken;
  }
  ERR_clear_error();
  if (taken == 0) return TlsFault(kAuthorityOption, "there is no certificate in it");
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  return absl::OkStatus();
}

absl::StatusOr<std::string> ReadPem(const char* option, const std::string& path) {
  if (path.empty()) return std::string();
  auto content = host::ReadFile(path, kMaxMetricsPemBytes);
  if (content.ok()) return content;
  return absl::InvalidArgumentError(absl::StrCat(option, " ", content.status().message()));
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
  auto certificate = ReadPem(kCertOption, files.certificate);
  auto key = ReadPem(kKeyOption, files.key);
  auto client_authority = ReadPem(kAuthorityOption, files.client_authority);
  for (const auto* read : {&certificate, &key, &client_authority}) {
    if (!read->ok()) return read->status();
  }
  if (certificate->empty()) return absl::InvalidArgumentError(absl::StrCat(kCertOption, ": is empty"));
  if (!files.client_authority.empty() && client_authority->empty()) {
    return absl::InvalidArgumentError(absl::StrCat(kAuthorityOption, ": is empty"));
  }
  MetricsTls tls{
      .certificate = *std::move(certificate), .key = *std::move(key), .client_authority = *std::move(client_authority)};
  const ServerContext context(SSL_CTX_new(TLS_server_method()));
  if (!context) return TlsFault(kCertOption, "TLS cannot be used");
  if (absl::Status status = SetMetricsTls(context.get(), tls); !status.ok()) return status;
  return tls;
}

absl::Status SetMetricsTls(SSL_CTX* context, const MetricsTls& tls) {
  if (SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION) != 1) return TlsFault(kCertOption, "no TLS 1.2");
  // One request a connection: there is nothing to resume.
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(context, SSL_OP_NO_TICKET);
  if (absl::Status status = SetOwn(context, tls); !status.ok()) return status;
  return tls.client_authority.empty() ? absl::OkStatus() : SetClients(context, tls.client_authority);
}

}  // namespace tessera::telemetry
