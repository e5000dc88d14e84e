// Key files of issuers, as this and as OpenSSL writes them.
#include "trust/ticket_key.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trust/certificate.h"

namespace tessera::trust {
namespace {

using ::testing::HasSubstr;

TEST(TicketKeyTest, AKeyFileReadsBack) {
  const TicketSeed seed{1, 2, 3};
  const auto pem = TicketKeyPem(seed);
  ASSERT_TRUE(pem.ok()) << pem.status();
  EXPECT_EQ(*ReadTicketKey(*pem), seed);
  EXPECT_EQ(*ReadTicketPublicKey(*pem), PublicKeyOf(seed));
  const auto public_pem = TicketPublicKeyPem(PublicKeyOf(seed));
  ASSERT_TRUE(public_pem.ok()) << public_pem.status();
  EXPECT_EQ(*ReadTicketPublicKey(*public_pem), PublicKeyOf(seed));
}

// `openssl genpkey -algorithm ed25519` with the seed 00 01 ... 1f, and its public half.
TEST(TicketKeyTest, OpensslsFilesAreRead) {
  const std::string pem =
      "-----BEGIN PRIVATE KEY-----\n"
      "MC4CAQAwBQYDK2VwBCIEIAABAgMEBQYHCAkKCwwNDg8QERITFBUWFxgZGhscHR4f\n"
      "-----END PRIVATE KEY-----\n";
  const auto seed = ReadTicketKey(pem);
  ASSERT_TRUE(seed.ok()) << seed.status();
  for (std::size_t i = 0; i < seed->size(); ++i) EXPECT_EQ((*seed)[i], i);
}

TEST(TicketKeyTest, OtherFilesAreRefused) {
  EXPECT_THAT(std::string(ReadTicketKey("").status().message()), HasSubstr("key: is no PEM"));
  EXPECT_THAT(std::string(ReadTicketKey(std::string(5000, 'x')).status().message()), HasSubstr("more than 4096"));
  EXPECT_THAT(std::string(ReadTicketKey(*MakeKey()).status().message()), HasSubstr("not an Ed25519 key"));
  EXPECT_THAT(std::string(ReadTicketKey(*TicketPublicKeyPem(PublicKeyOf(TicketSeed{1}))).status().message()),
              HasSubstr("is a public key"));
}

}  // namespace
}  // namespace tessera::trust
