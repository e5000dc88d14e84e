// OpenSSL's objects with an owner, and its errors as statuses.
#pragma once

#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace tessera::trust {

template <auto Free>
struct Freed {
  template <class Object>
  void operator()(Object* object) const {
    Free(object);
  }
};

using BioHandle = std::unique_ptr<BIO, Freed<BIO_free_all>>;
using BignumHandle = std::unique_ptr<BIGNUM, Freed<BN_free>>;
using CertificateHandle = std::unique_ptr<X509, Freed<X509_free>>;
using KeyHandle = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using RequestHandle = std::unique_ptr<X509_REQ, Freed<X509_REQ_free>>;
using TlsContextHandle = std::unique_ptr<SSL_CTX, Freed<SSL_CTX_free>>;

// The last thing that OpenSSL complained of, and nothing left in its queue.
inline std::string TakeOpensslError() {
  char text[256] = "no reason given";
  if (const unsigned long error = ERR_peek_last_error(); error != 0) ERR_error_string_n(error, text, sizeof text);
  ERR_clear_error();
  return text;
}

inline absl::Status OpensslFault(const char* what) {
  return absl::InternalError(absl::StrCat(what, ": ", TakeOpensslError()));
}

inline BioHandle ReadFrom(const std::string& text) {
  return BioHandle(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

// An encrypted text is none that we read: without this OpenSSL would ask for its passphrase at the terminal.
inline int NoPassphrase(char*, int, int, void*) { return 0; }

// The private key in the text; null: there is none, and OpenSSL's queue says why.
inline KeyHandle PrivateKeyIn(const std::string& pem) {
  return KeyHandle(PEM_read_bio_PrivateKey(ReadFrom(pem).get(), nullptr, NoPassphrase, nullptr));
}

// The next certificate of a text that is being read; null: there is none, and OpenSSL's queue says why.
inline CertificateHandle NextCertificate(BIO* text) {
  return CertificateHandle(PEM_read_bio_X509(text, nullptr, NoPassphrase, nullptr));
}

inline std::string TextOf(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return size > 0 ? std::string(data, static_cast<std::size_t>(size)) : std::string();
}

}  // namespace tessera::trust
