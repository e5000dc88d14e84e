#include "trust/server_certificate.h"

#include <gmock/gmock.h>

#include <string>

#include "trust/certificate.h"

namespace tessera::trust {
namespace {

using ::testing::HasSubstr;

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

}  // namespace
}  // namespace tessera::trust
