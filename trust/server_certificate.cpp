#include "trust/server_certificate.h"

#include <openssl/pem.h>

#include "absl/strings/str_cat.h"
#include "trust/openssl_handles.h"

namespace tessera::trust {

absl::Status LoadServerCertificate(SSL_CTX* context, const ServerCertificate& certificate, const std::string& name) {
  const auto fault = [&name](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": ", what, ": ", TakeOpensslError()));
  };
  const BioHandle chain = ReadFrom(certificate.chain);
  const CertificateHandle own(PEM_read_bio_X509(chain.get(), nullptr, nullptr, nullptr));
  if (!own || SSL_CTX_use_certificate(context, own.get()) != 1) return fault("the certificate cannot be read");
  while (X509* next = PEM_read_bio_X509(chain.get(), nullptr, nullptr, nullptr)) {
    if (SSL_CTX_add0_chain_cert(context, next) != 1) {
      X509_free(next);
      return fault("the certificate's chain cannot be read");
    }
  }
  ERR_clear_error();  // the end of the file is one to OpenSSL
  const auto no_passphrase = [](char*, int, int, void*) { return 0; };
  const KeyHandle key(PEM_read_bio_PrivateKey(ReadFrom(certificate.key).get(), nullptr, no_passphrase, nullptr));
  if (!key || SSL_CTX_use_PrivateKey(context, key.get()) != 1 || SSL_CTX_check_private_key(context) != 1) {
    return fault("the key cannot be read, or is not the certificate's");
  }
  if (SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION) != 1) return fault("TLS 1.2 is not to be had");
  return absl::OkStatus();
}

absl::Status CheckServerCertificate(const ServerCertificate& certificate, const std::string& name) {
  const TlsContextHandle context(SSL_CTX_new(TLS_server_method()));
  return context ? LoadServerCertificate(context.get(), certificate, name) : OpensslFault("TLS cannot be used");
}

}  // namespace tessera::trust
