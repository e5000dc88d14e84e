#include "trust/certificate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/pem.h>

#include "trust/openssl_handles.h"

namespace tessera::trust {
namespace {

using ::testing::HasSubstr;

TEST(CertificateTest, AHostsCertificateSaysWhoItIsAndWhichOneItIs) {
  const auto authority = MakeAuthority();
  ASSERT_TRUE(authority.ok()) << authority.status();
  const auto key = MakeKey();
  const auto request = MakeRequest(*key);
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_TRUE(CheckRequest(*request).ok());
  const auto certificate = IssueClient(*authority, *request, "host-7", "1f00");
  ASSERT_TRUE(certificate.ok()) << certificate.status();
  const auto facts = ReadCertificate(*certificate);
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(facts->common_name, "host-7");
  EXPECT_EQ(facts->serial, "1f00");
  EXPECT_TRUE(IsFingerprint(facts->fingerprint));
  EXPECT_NE(facts->fingerprint, ReadCertificate(authority->certificate)->fingerprint);
}

TEST(CertificateTest, ASerialHasOneSpelling) {
  const auto authority = MakeAuthority();
  const auto request = MakeRequest(*MakeKey());
  const auto serial_of = [&](const std::string& serial) {
    const auto certificate = IssueClient(*authority, *request, "host-1", serial);
    return certificate.ok() ? ReadCertificate(*certificate)->serial : "none";
  };
  EXPECT_EQ(serial_of("00ab"), "ab");
  EXPECT_EQ(serial_of("AB"), "ab");
  EXPECT_EQ(serial_of(std::string(40, '7')), std::string(40, '7'));
  for (const std::string bad : {"", "xyz", "-1", " 1"}) EXPECT_EQ(serial_of(bad), "none") << bad;
  EXPECT_EQ(serial_of(std::string(42, '7')), "none");
}

TEST(CertificateTest, WhatIsNoRequestIsRefused) {
  const std::string good = *MakeRequest(*MakeKey());
  std::string forged = good;
  char& changed = forged[forged.size() / 2];
  changed = changed == 'A' ? 'B' : 'A';
  const std::string certificate = MakeAuthority()->certificate;
  for (const std::string& bad : {std::string(), std::string("hello"), forged, certificate, good.substr(0, 90),
                                 std::string(kMaxPemBytes + 1, 'x')}) {
    const absl::Status status = CheckRequest(bad);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << bad;
    EXPECT_THAT(std::string(status.message()), HasSubstr("certificate_request: "));
  }
}

// A request as anybody may make one, signed by a key on `curve`.
std::string RequestOn(const char* curve) {
  const KeyHandle key(EVP_EC_gen(curve));
  const RequestHandle request(X509_REQ_new());
  const BioHandle bio(BIO_new(BIO_s_mem()));
  X509_REQ_set_pubkey(request.get(), key.get());
  X509_REQ_sign(request.get(), key.get(), EVP_sha256());
  PEM_write_bio_X509_REQ(bio.get(), request.get());
  return TextOf(bio.get());
}

TEST(CertificateTest, OnlyTheKindOfKeyThatTheClusterUsesIsSigned) {
  EXPECT_TRUE(CheckRequest(RequestOn("P-256")).ok());
  EXPECT_THAT(std::string(CheckRequest(RequestOn("P-384")).message()), HasSubstr("not on the curve P-256"));
}

TEST(CertificateTest, AKeyOpensWithItsPassphraseAlone) {
  const std::string key = *MakeKey();
  const auto encrypted = EncryptKey(key, "correct horse");
  ASSERT_TRUE(encrypted.ok()) << encrypted.status();
  EXPECT_THAT(*encrypted, HasSubstr("ENCRYPTED"));
  EXPECT_EQ(*DecryptKey(*encrypted, "correct horse"), key);
  EXPECT_EQ(DecryptKey(*encrypted, "battery staple").status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(DecryptKey("damaged", "correct horse").status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(DecryptKey(*encrypted, std::string(5000, 'x')).status().code(), absl::StatusCode::kPermissionDenied);
}

}  // namespace
}  // namespace tessera::trust
