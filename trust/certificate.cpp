#include "trust/certificate.h"

#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "trust/openssl_handles.h"

namespace tessera::trust {
namespace {

// By RFC 5280 the last moment means "no known end". The first is OpenSSL's zero.
constexpr char kFirstMoment[] = "19700101000000Z", kLastMoment[] = "99991231235959Z";
constexpr char kAuthorityName[] = "Tessera cluster authority";
constexpr int kFingerprintDigits = 64;
constexpr int kMaxSerialBytes = 20;  // RFC 5280

enum class Purpose { kAuthority, kServer, kClient };

absl::StatusOr<std::string> KeyText(EVP_PKEY* key) {
  const BioHandle bio(BIO_new(BIO_s_mem()));
  if (!bio || PEM_write_bio_PKCS8PrivateKey(bio.get(), key, nullptr, nullptr, 0, nullptr, nullptr) != 1) {
    return OpensslFault("key cannot be written");
  }
  return TextOf(bio.get());
}

absl::StatusOr<KeyHandle> KeyFrom(const std::string& text) {
  KeyHandle key = PrivateKeyIn(text);
  if (!key) return absl::InvalidArgumentError(absl::StrCat("key: cannot be read: ", TakeOpensslError()));
  return key;
}

absl::StatusOr<CertificateHandle> CertificateFrom(const std::string& text) {
  if (text.size() > kMaxPemBytes) {
    return absl::InvalidArgumentError(absl::StrCat("certificate: more than ", kMaxPemBytes, " bytes"));
  }
  CertificateHandle certificate = NextCertificate(ReadFrom(text).get());
  if (!certificate)
    return absl::InvalidArgumentError(absl::StrCat("certificate: cannot be read: ", TakeOpensslError()));
  return certificate;
}

absl::StatusOr<RequestHandle> RequestFrom(const std::string& text) {
  if (text.size() > kMaxPemBytes) {
    return absl::InvalidArgumentError(absl::StrCat("certificate_request: more than ", kMaxPemBytes, " bytes"));
  }
  const BioHandle bio = ReadFrom(text);
  RequestHandle request(PEM_read_bio_X509_REQ(bio.get(), nullptr, NoPassphrase, nullptr));
  if (!request) {
    return absl::InvalidArgumentError(absl::StrCat("certificate_request: cannot be read: ", TakeOpensslError()));
  }
  EVP_PKEY* key = X509_REQ_get0_pubkey(request.get());
  char group[32] = {};
  std::size_t length = 0;
  const bool is_p256 = key != nullptr && EVP_PKEY_get_base_id(key) == EVP_PKEY_EC &&
                       EVP_PKEY_get_group_name(key, group, sizeof group, &length) == 1 &&
                       std::string(group, length) == SN_X9_62_prime256v1;
  if (!is_p256) return absl::InvalidArgumentError("certificate_request: its key is not on the curve P-256");
  if (X509_REQ_verify(request.get(), key) != 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("certificate_request: is not signed with its own key: ", TakeOpensslError()));
  }
  return request;
}

bool SetSerial(X509* certificate, const std::string& serial) {
  BIGNUM* raw = nullptr;
  const bool plain = !serial.empty() && serial.size() <= 2 * kMaxSerialBytes &&
                     std::all_of(serial.begin(), serial.end(), [](unsigned char c) { return absl::ascii_isxdigit(c); });
  if (!plain || BN_hex2bn(&raw, serial.c_str()) == 0) return false;
  const BignumHandle number(raw);
  return BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate)) != nullptr;
}

bool SetName(X509_NAME* name, const std::string& common_name) {
  return X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8,
                                    reinterpret_cast<const unsigned char*>(common_name.data()),
                                    static_cast<int>(common_name.size()), -1, 0) == 1;
}

bool AddExtension(X509* certificate, X509V3_CTX* context, int kind, const std::string& value) {
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, context, kind, value.c_str());
  if (extension == nullptr) return false;
  const bool added = X509_add_ext(certificate, extension, -1) == 1;
  X509_EXTENSION_free(extension);
  return added;
}

bool AddExtensions(X509* certificate, X509* issuer, Purpose purpose) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const auto add = [&](int kind, const std::string& value) { return AddExtension(certificate, &context, kind, value); };
  switch (purpose) {
    case Purpose::kAuthority:
      return add(NID_basic_constraints, "critical,CA:TRUE,pathlen:0") && add(NID_key_usage, "critical,keyCertSign") &&
             add(NID_subject_key_identifier, "hash");
    case Purpose::kServer:
      return add(NID_basic_constraints, "critical,CA:FALSE") && add(NID_key_usage, "critical,digitalSignature") &&
             add(NID_ext_key_usage, "serverAuth") && add(NID_subject_alt_name, absl::StrCat("DNS:", kControlName)) &&
             add(NID_authority_key_identifier, "keyid");
    case Purpose::kClient:
      return add(NID_basic_constraints, "critical,CA:FALSE") && add(NID_key_usage, "critical,digitalSignature") &&
             add(NID_ext_key_usage, "clientAuth") && add(NID_authority_key_identifier, "keyid");
  }
  return false;
}

// Signed by `issuer`'s key; an authority is its own issuer.
absl::StatusOr<std::string> Issue(Purpose purpose, const std::string& common_name, const std::string& serial,
                                  EVP_PKEY* subject_key, X509* issuer, EVP_PKEY* issuer_key) {
  const CertificateHandle certificate(X509_new());
  if (!certificate) return OpensslFault("certificate");
  X509* made = certificate.get();
  if (!SetSerial(made, serial)) {
    return absl::InvalidArgumentError("serial: is not 1 to 20 bytes in hexadecimal digits");
  }
  const bool filled =
      X509_set_version(made, X509_VERSION_3) == 1 && SetName(X509_get_subject_name(made), common_name) &&
      X509_set_issuer_name(made, X509_get_subject_name(issuer == nullptr ? made : issuer)) == 1 &&
      ASN1_TIME_set_string(X509_getm_notBefore(made), kFirstMoment) == 1 &&
      ASN1_TIME_set_string(X509_getm_notAfter(made), kLastMoment) == 1 && X509_set_pubkey(made, subject_key) == 1 &&
      AddExtensions(made, issuer == nullptr ? made : issuer, purpose);
  if (!filled || X509_sign(made, issuer_key, EVP_sha256()) == 0) return OpensslFault("certificate cannot be signed");
  const BioHandle bio(BIO_new(BIO_s_mem()));
  if (!bio || PEM_write_bio_X509(bio.get(), made) != 1) return OpensslFault("certificate cannot be written");
  return TextOf(bio.get());
}

absl::StatusOr<std::string> IssueFrom(const KeyedCertificate& authority, Purpose purpose, const std::string& name,
                                      const std::string& serial, EVP_PKEY* subject_key) {
  const auto issuer = CertificateFrom(authority.certificate);
  if (!issuer.ok()) return issuer.status();
  const auto issuer_key = KeyFrom(authority.key);
  if (!issuer_key.ok()) return issuer_key.status();
  return Issue(purpose, name, serial, subject_key, issuer->get(), issuer_key->get());
}

}  // namespace

absl::StatusOr<std::string> MakeKey() {
  const KeyHandle key(EVP_EC_gen(SN_X9_62_prime256v1));
  if (!key) return OpensslFault("key cannot be made");
  return KeyText(key.get());
}

absl::StatusOr<KeyedCertificate> MakeAuthority() {
  auto key_text = MakeKey();
  if (!key_text.ok()) return key_text.status();
  const auto key = KeyFrom(*key_text);
  if (!key.ok()) return key.status();
  auto certificate = Issue(Purpose::kAuthority, kAuthorityName, "01", key->get(), nullptr, key->get());
  if (!certificate.ok()) return certificate.status();
  return KeyedCertificate{*std::move(certificate), *std::move(key_text)};
}

absl::StatusOr<KeyedCertificate> IssueServer(const KeyedCertificate& authority, const std::string& serial) {
  auto key_text = MakeKey();
  if (!key_text.ok()) return key_text.status();
  const auto key = KeyFrom(*key_text);
  if (!key.ok()) return key.status();
  auto certificate = IssueFrom(authority, Purpose::kServer, kControlName, serial, key->get());
  if (!certificate.ok()) return certificate.status();
  return KeyedCertificate{*std::move(certificate), *std::move(key_text)};
}

absl::StatusOr<std::string> MakeRequest(const std::string& key_text) {
  const auto key = KeyFrom(key_text);
  if (!key.ok()) return key.status();
  const RequestHandle request(X509_REQ_new());
  const BioHandle bio(BIO_new(BIO_s_mem()));
  if (!request || !bio || X509_REQ_set_version(request.get(), X509_REQ_VERSION_1) != 1 ||
      !SetName(X509_REQ_get_subject_name(request.get()), "tessera host") ||
      X509_REQ_set_pubkey(request.get(), key->get()) != 1 ||
      X509_REQ_sign(request.get(), key->get(), EVP_sha256()) == 0 ||
      PEM_write_bio_X509_REQ(bio.get(), request.get()) != 1) {
    return OpensslFault("certificate request");
  }
  return TextOf(bio.get());
}

absl::Status CheckRequest(const std::string& request) { return RequestFrom(request).status(); }

absl::StatusOr<std::string> IssueClient(const KeyedCertificate& authority, const std::string& request_text,
                                        const std::string& common_name, const std::string& serial) {
  const auto request = RequestFrom(request_text);
  if (!request.ok()) return request.status();
  return IssueFrom(authority, Purpose::kClient, common_name, serial, X509_REQ_get0_pubkey(request->get()));
}

absl::StatusOr<CertificateFacts> ReadCertificate(const std::string& text) {
  const auto certificate = CertificateFrom(text);
  if (!certificate.ok()) return certificate.status();
  CertificateFacts facts;
  const X509_NAME* subject = X509_get_subject_name(certificate->get());
  if (const int at = X509_NAME_get_index_by_NID(subject, NID_commonName, -1); at >= 0) {
    const ASN1_STRING* name = X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at));
    facts.common_name.assign(reinterpret_cast<const char*>(ASN1_STRING_get0_data(name)),
                             static_cast<std::size_t>(ASN1_STRING_length(name)));
  }
  const BignumHandle number(ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate->get()), nullptr));
  char* digits = number ? BN_bn2hex(number.get()) : nullptr;
  if (digits == nullptr) return OpensslFault("certificate's serial");
  facts.serial = absl::AsciiStrToLower(digits);
  OPENSSL_free(digits);
  facts.serial.erase(0, std::min(facts.serial.find_first_not_of('0'), facts.serial.size() - 1));
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  if (X509_digest(certificate->get(), EVP_sha256(), digest, &size) != 1) return OpensslFault("certificate's digest");
  facts.fingerprint = absl::BytesToHexString({reinterpret_cast<const char*>(digest), size});
  return facts;
}

absl::StatusOr<std::string> EncryptKey(const std::string& key_text, const std::string& passphrase) {
  const auto key = KeyFrom(key_text);
  if (!key.ok()) return key.status();
  const BioHandle bio(BIO_new(BIO_s_mem()));
  if (!bio || PEM_write_bio_PKCS8PrivateKey(bio.get(), key->get(), EVP_aes_256_cbc(), passphrase.data(),
                                            static_cast<int>(passphrase.size()), nullptr, nullptr) != 1) {
    return OpensslFault("key cannot be encrypted");
  }
  return TextOf(bio.get());
}

absl::StatusOr<std::string> DecryptKey(const std::string& encrypted, const std::string& passphrase) {
  const BioHandle bio = ReadFrom(encrypted);
  const auto answer = [](char* out, int size, int, void* given) {
    const auto& text = *static_cast<const std::string*>(given);
    if (text.size() > static_cast<std::size_t>(size)) return -1;
    std::copy(text.begin(), text.end(), out);
    return static_cast<int>(text.size());
  };
  const KeyHandle key(PEM_read_bio_PrivateKey(bio.get(), nullptr, answer, const_cast<std::string*>(&passphrase)));
  if (!key) {
    ERR_clear_error();
    return absl::PermissionDeniedError("key: it was encrypted with another passphrase, or is damaged");
  }
  return KeyText(key.get());
}

bool IsFingerprint(const std::string& text) {
  return text.size() == kFingerprintDigits && std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return absl::ascii_isdigit(c) || (c >= 'a' && c <= 'f');
         });
}

}  // namespace tessera::trust
