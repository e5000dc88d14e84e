#include "control_plane/authority.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "control_plane/memory_store.h"
#include "host/temporary_folder.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

class AuthorityTest : public ::testing::Test {
 protected:
  const host::TemporaryFolder folder_;
  const std::string seal_ = folder_.path() + "/seal.key";
  MemoryStore store_;
};

TEST_F(AuthorityTest, IsMadeOnceAndOpenedEachTime) {
  const auto first = OpenAuthority(store_, seal_, SystemRandomBytes);
  ASSERT_TRUE(first.ok()) << first.status();
  const auto second = OpenAuthority(store_, seal_, SystemRandomBytes);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(first->fingerprint, second->fingerprint);
  EXPECT_EQ(first->signer.key, second->signer.key);
  EXPECT_TRUE(trust::IsFingerprint(first->fingerprint));
}

TEST_F(AuthorityTest, TheStoreAloneDoesNotSign) {
  const auto authority = OpenAuthority(store_, seal_, SystemRandomBytes);
  const std::string stored = store_.Get("authority")->value;
  EXPECT_EQ(stored.find(authority->signer.key.substr(30, 40)), std::string::npos);
  EXPECT_THAT(stored, HasSubstr("ENCRYPTED"));
  struct stat found {};
  ASSERT_EQ(stat(seal_.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 077, 0u) << "only its owner reads the passphrase";
}

TEST_F(AuthorityTest, WithoutItsSealNothingNewIsMade) {
  ASSERT_TRUE(OpenAuthority(store_, seal_, SystemRandomBytes).ok());
  const std::string before = store_.Get("authority")->value;
  std::filesystem::rename(seal_, seal_ + ".away");
  EXPECT_EQ(OpenAuthority(store_, seal_, SystemRandomBytes).status().code(), absl::StatusCode::kFailedPrecondition);
  MemoryStore other;
  ASSERT_TRUE(OpenAuthority(other, seal_, SystemRandomBytes).ok());  // another cluster's seal
  EXPECT_THAT(std::string(OpenAuthority(store_, seal_, SystemRandomBytes).status().message()),
              HasSubstr("put the file back"));
  EXPECT_EQ(store_.Get("authority")->value, before);
}

}  // namespace
}  // namespace tessera::control
