#include "trust/server_certificate.h"

#include <openssl/ssl.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "host/files.h"
#include "trust/openssl_handles.h"

namespace tessera::trust {

absl::StatusOr<std::string> ReadPemFile(const PemOption& file) {
  auto text = host::ReadFile(file.path, kMaxPemFileBytes);
  if (!text.ok()) return absl::InvalidArgumentError(absl::StrCat(file.option, " ", text.status().message()));
  if (text->find("-----BEGIN") == std::string::npos) {
    return absl::InvalidArgumentError(absl::StrCat(file.option, " ", file.path, " is no PEM file"));
  }
  return text;
}

absl::StatusOr<ServerCertificate> ReadServerCertificate(const PemOption& chain, const PemOption& key) {
  auto chain_text = ReadPemFile(chain), key_text = ReadPemFile(key);
  if (!chain_text.ok()) return chain_text.status();
  if (!key_text.ok()) return key_text.status();
  return ServerCertificate{.chain = *std::move(chain_text), .key = *std::move(key_text)};
}

absl::Status LoadServerCertificate(SSL_CTX* context, const ServerCertificate& certificate, const std::string& name,
                                   const std::string& key_name) {
  const auto fault = [](const std::string& of, const char* what) {
    return absl::InvalidArgumentError(absl::StrCat(of, ": ", what, ": ", TakeOpensslError()));
  };
  const BioHandle chain = ReadFrom(certificate.chain);
  const CertificateHandle own = NextCertificate(chain.get());
  if (!own || SSL_CTX_use_certificate(context, own.get()) != 1) return fault(name, "the certificate cannot be read");
  while (CertificateHandle next = NextCertificate(chain.get())) {
    if (SSL_CTX_add0_chain_cert(context, next.get()) != 1) return fault(name, "the certificate's chain cannot be read");
    (void)next.release();  // the context's now
  }
  ERR_clear_error();  // the end of the file is one to OpenSSL
  const KeyHandle key = PrivateKeyIn(certificate.key);
  if (!key || SSL_CTX_use_PrivateKey(context, key.get()) != 1 || SSL_CTX_check_private_key(context) != 1) {
    return fault(key_name.empty() ? name : key_name, "the key cannot be read, or is not the certificate's");
  }
  if (SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION) != 1) return fault(name, "TLS 1.2 is not to be had");
  return absl::OkStatus();
}

absl::Status CheckServerCertificate(const ServerCertificate& certificate, const std::string& name) {
  const TlsContextHandle context(SSL_CTX_new(TLS_server_method()));
  return context ? LoadServerCertificate(context.get(), certificate, name) : OpensslFault("TLS cannot be used");
}

}  // namespace tessera::trust
