// TLS for a FakeDoor.
//
//   const FakeDoor door(TlsWith(*trust::IssueServer(authority, "01"), authority.certificate), answerer);
//
// Thread rule: the opener is called by the door's thread.
#pragma once

#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>

#include <memory>
#include <string>

#include "client_sdk/testing/fake_door.h"
#include "trust/certificate.h"
#include "trust/openssl_handles.h"

namespace tessera::client {

// A server by TLS: shows `own`, and the certificates of `chain` with it.
inline FakeDoor::Opener TlsWith(const trust::KeyedCertificate& own, const std::string& chain) {
  const std::shared_ptr<SSL_CTX> context(SSL_CTX_new(TLS_server_method()), SSL_CTX_free);
  const trust::CertificateHandle leaf(
      PEM_read_bio_X509(trust::ReadFrom(own.certificate).get(), nullptr, nullptr, nullptr));
  const trust::KeyHandle key(PEM_read_bio_PrivateKey(trust::ReadFrom(own.key).get(), nullptr, nullptr, nullptr));
  EXPECT_EQ(SSL_CTX_use_certificate(context.get(), leaf.get()), 1);
  EXPECT_EQ(SSL_CTX_use_PrivateKey(context.get(), key.get()), 1);
  const trust::BioHandle more = trust::ReadFrom(chain);
  while (X509* next = PEM_read_bio_X509(more.get(), nullptr, nullptr, nullptr)) {
    EXPECT_EQ(SSL_CTX_add0_chain_cert(context.get(), next), 1);
  }
  ERR_clear_error();
  return [context](int socket) -> FakeDoor::Stream {
    const std::shared_ptr<SSL> tls(SSL_new(context.get()), SSL_free);
    SSL_set_fd(tls.get(), socket);
    if (SSL_accept(tls.get()) != 1) {
      ERR_clear_error();
      return {};
    }
    return {
        [tls](char* bytes, std::size_t size) -> ssize_t { return SSL_read(tls.get(), bytes, static_cast<int>(size)); },
        [tls](const std::string& bytes) {
          EXPECT_GT(SSL_write(tls.get(), bytes.data(), static_cast<int>(bytes.size())), 0);
          SSL_shutdown(tls.get());
        }};
  };
}

}  // namespace tessera::client
