#include "trust/server_certificate.h"

#include <gmock/gmock.h>

#include <string>

#include "host/files.h"
#include "host/temporary_folder.h"
#include "trust/certificate.h"

namespace tessera::trust {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(ServerCertificateTest, OneWithItsKeyIsTakenAndEachFaultIsNamed) {
  const auto authority = MakeAuthority();
  ASSERT_TRUE(authority.ok()) << authority.status();
  const auto own = IssueServer(*authority, "07");
  ASSERT_TRUE(own.ok()) << own.status();
  const ServerCertificate good{.chain = own->certificate + authority->certificate, .key = own->key};
  EXPECT_TRUE(CheckServerCertificate(good, "--certificate").ok());
  const auto fault = [](const ServerCertificate& certificate) {
    const absl::Status status = CheckServerCertificate(certificate, "--certificate");
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_THAT(fault({.chain = "no PEM", .key = own->key}),
              HasSubstr("--certificate: the certificate cannot be read: "));
  EXPECT_THAT(fault({.chain = good.chain, .key = "no PEM"}), HasSubstr("the key cannot be read"));
  EXPECT_THAT(fault({.chain = good.chain, .key = *MakeKey()}), HasSubstr("is not the certificate's"));
}

TEST(ServerCertificateTest, FilesAreReadWholeAndEachFaultNamesItsOption) {
  const host::TemporaryFolder folder;
  const auto write = [&folder](const std::string& name, const std::string& text) {
    const std::string path = folder.path() + "/" + name;
    EXPECT_TRUE(host::WriteFile(path, text, host::Durability::kSurvivesProcess).ok());
    return path;
  };
  const std::string key = *MakeKey(), certificate = MakeAuthority()->certificate;
  const PemOption chain_file{"--certificate", write("chain.pem", certificate + certificate)};
  const auto read = ReadServerCertificate(chain_file, {"--key", write("key.pem", key)});
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->chain, certificate + certificate);
  EXPECT_EQ(read->key, key);
  const auto fault = [&](const std::string& key_path) {
    const absl::Status status = ReadServerCertificate(chain_file, {"--key", key_path}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_THAT(fault(folder.path() + "/none.pem"), StartsWith("--key " + folder.path() + "/none.pem"));
  EXPECT_EQ(fault(write("empty.pem", "")), "--key " + folder.path() + "/empty.pem is no PEM file");
  EXPECT_THAT(fault(write("large.pem", std::string(kMaxPemFileBytes + 1, 'x'))), StartsWith("--key "));
}

// OpenSSL would ask for the passphrase at the terminal of whoever starts the program, and wait.
TEST(ServerCertificateTest, AnEncryptedKeyIsRefusedUnasked) {
  const auto authority = MakeAuthority();
  const auto encrypted = EncryptKey(authority->key, "a passphrase");
  ASSERT_TRUE(encrypted.ok()) << encrypted.status();
  const absl::Status status =
      CheckServerCertificate({.chain = authority->certificate, .key = *encrypted}, "--certificate");
  EXPECT_THAT(std::string(status.message()), HasSubstr("the key cannot be read"));
  EXPECT_FALSE(MakeRequest(*encrypted).ok());
}

}  // namespace
}  // namespace tessera::trust
