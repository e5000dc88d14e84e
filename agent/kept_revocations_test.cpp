#include "agent/kept_revocations.h"

#include <fstream>
#include <memory>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "host/temporary_folder.h"
#include "net/signing_key.h"
#include "trust/revocation_list.h"

namespace tessera::agent {
namespace {

using ::testing::HasSubstr;

class KeptRevocationsTest : public ::testing::Test {
 protected:
  static std::string PublicKeyOf(const net::SigningKey& key) {
    return {key.verification_key().begin(), key.verification_key().end()};
  }
  v1::SignedRevocations List(std::uint64_t number) const { return List(number, key_); }
  static v1::SignedRevocations List(std::uint64_t number, const net::SigningKey& key) {
    v1::Revocations content;
    content.set_number(number);
    v1::RevokedWorker& worker = *content.add_workers();
    worker.set_instance_id("inst-1");
    worker.set_region(2);
    worker.set_incarnation(number);
    return *trust::SignRevocations(content, key);
  }
  // As an agent that begins on this folder has it.
  KeptRevocations Begun() {
    KeptRevocations kept(*dir_);
    EXPECT_TRUE(kept.Begin(PublicKeyOf(key_)).ok());
    return kept;
  }

  host::TemporaryFolder temporary_;
  std::unique_ptr<StateDir> dir_ = StateDir::Open(temporary_.path() + "/state").value();
  const net::SigningKey key_ = net::SigningKey::Make();
};

TEST_F(KeptRevocationsTest, TheNewestIsKeptForTheNextAgentAndAnOlderOneIsRefused) {
  KeptRevocations kept = Begun();
  EXPECT_EQ(kept.number(), 0u);
  ASSERT_TRUE(kept.Take(List(3)).ok());
  EXPECT_TRUE(kept.Take(List(3)).ok()) << "it is kept already";
  EXPECT_EQ(kept.Take(List(2)),
            absl::FailedPreconditionError("revocations.number: 2 is older than 3, which is kept here"));
  KeptRevocations next = Begun();
  EXPECT_EQ(next.number(), 3u);
  EXPECT_EQ(next.newest().SerializeAsString(), List(3).SerializeAsString());
  const RevokedLives lives = next.lives();
  ASSERT_EQ(lives.at("inst-1").size(), 1u);
  EXPECT_EQ(lives.at("inst-1")[0].region(), 2u);
  EXPECT_EQ(lives.at("inst-1")[0].incarnation(), 3u);
  ASSERT_TRUE(next.Take(List(4)).ok());
  EXPECT_EQ(Begun().number(), 4u);
}

TEST_F(KeptRevocationsTest, AListThatAnotherKeySignedIsRefused) {
  KeptRevocations kept = Begun();
  EXPECT_EQ(kept.Take(List(9, net::SigningKey::Make())).code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(kept.number(), 0u);
  KeptRevocations without_key(*dir_);
  EXPECT_EQ(without_key.Take(List(9)).code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(KeptRevocationsTest, AFileThatWasTamperedWithCountsForNothingAndTheNextListTakesItsPlace) {
  ASSERT_TRUE(Begun().Take(List(3)).ok());
  KeptRevocationsFile file;
  *file.mutable_revocations() = List(1'000, net::SigningKey::Make());
  ASSERT_TRUE(dir_->SaveRevocations(file).ok());
  KeptRevocations kept(*dir_);
  const absl::Status begun = kept.Begin(PublicKeyOf(key_));
  EXPECT_EQ(begun.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(begun.message()), HasSubstr("revocations.json: revocations.signature"));
  EXPECT_EQ(kept.number(), 0u);
  ASSERT_TRUE(kept.Take(List(4)).ok());
  std::ofstream(dir_->RevocationsPath()) << "rubbish";
  EXPECT_EQ(kept.Begin(PublicKeyOf(key_)).code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace tessera::agent
