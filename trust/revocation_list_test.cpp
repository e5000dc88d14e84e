#include "trust/revocation_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera::trust {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

v1::Revocations Some() {
  v1::Revocations content;
  content.set_number(7);
  v1::RevokedHosts& run = *content.add_hosts();
  run.set_first(2);
  run.set_last(4);
  v1::RevokedWorker& worker = *content.add_workers();
  worker.set_instance_id("inst-1");
  worker.set_region(3);
  worker.set_incarnation(12);
  return content;
}

TEST(RevocationListTest, WhatTheClustersKeySignedIsReadByItsPublicHalf) {
  const net::SigningKey key = net::SigningKey::Make();
  const auto list = SignRevocations(Some(), key);
  ASSERT_TRUE(list.ok()) << list.status();
  const auto read = ReadRevocations(*list, key.verification_key());
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->SerializeAsString(), Some().SerializeAsString());
}

TEST(RevocationListTest, AnotherKeysAChangedOneAndACutOneAreRefused) {
  const net::SigningKey key = net::SigningKey::Make();
  v1::SignedRevocations list = *SignRevocations(Some(), key);
  EXPECT_EQ(ReadRevocations(list, net::SigningKey::Make().verification_key()).status().code(),
            absl::StatusCode::kUnauthenticated);
  v1::Revocations newer = Some();
  newer.set_number(8);
  v1::SignedRevocations changed = list;
  changed.set_list(newer.SerializeAsString());
  EXPECT_EQ(ReadRevocations(changed, key.verification_key()).status().code(), absl::StatusCode::kUnauthenticated);
  list.mutable_signature()->pop_back();
  EXPECT_EQ(ReadRevocations(list, key.verification_key()).status(),
            absl::InvalidArgumentError("revocations.signature: has 63 bytes, not 64"));
}

TEST(RevocationListTest, ItIsBoundedAndAFullOneSaysHowRoomIsMade) {
  const net::SigningKey key = net::SigningKey::Make();
  v1::Revocations content = Some();
  content.set_sealed_bans(std::string(kMaxRevocationBytes - content.ByteSizeLong() - 8, 'x'));
  EXPECT_TRUE(SignRevocations(content, key).ok());
  content.mutable_sealed_bans()->append(64, 'x');
  const absl::Status full = SignRevocations(content, key).status();
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(full.message()), HasSubstr("at most 1048576; lift bans (tessera player unban)"));
  v1::SignedRevocations large;
  large.set_list(content.SerializeAsString());
  EXPECT_THAT(std::string(ReadRevocations(large, key.verification_key()).status().message()),
              HasSubstr("revocations.list: has "));
}

TEST(RevocationListTest, WhatIsSealedIsReadByTheHolderOfTheKeyAlone) {
  const net::SigningKey key = net::SigningKey::Make();
  const std::string nonce(kSealNonceBytes, 'n');
  std::string sealed = SealFor(key, "ada cheats", nonce);
  EXPECT_THAT(sealed, Not(HasSubstr("ada")));
  EXPECT_EQ(*Unseal(key, sealed), "ada cheats");
  EXPECT_EQ(Unseal(net::SigningKey::Make(), sealed).status().code(), absl::StatusCode::kDataLoss);
  sealed.back() = static_cast<char>(sealed.back() ^ 1);
  EXPECT_EQ(Unseal(key, sealed).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(Unseal(key, "short").status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace tessera::trust
