// Checkpoints in an object store, which may refuse, hang, cut its answers short or damage what it keeps.
#include "control_plane/s3/s3_target.h"

#include <gmock/gmock.h>

#include <future>

#include "control_plane/checkpoint_files.h"
#include "control_plane/s3/testing/fake_s3.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;
using Code = absl::StatusCode;

constexpr S3Patience kShort{
    .connect = milliseconds(2000), .slow = std::chrono::seconds(1), .between_tries = milliseconds(1)};
constexpr char kAddress[] = "s3://worlds/tessera";

class S3TargetTest : public testing::Test {
 protected:
  S3TargetTest() : store_(Store()) {
    store_.Reset();
    auto target = S3Target::Open(store_.Settings(kAddress), kShort);
    EXPECT_TRUE(target.ok()) << target.status();
    target_ = target->get();
    files_ = std::make_unique<CheckpointFiles>(*std::move(target));
  }
  void Make(const std::string& instance, std::uint64_t tick) {
    records::Manifest manifest;
    manifest.set_tick(tick);
    for (const std::string name : {"region-1", "region-2", "scene"}) {
      const std::string bytes = name + " at " + std::to_string(tick);
      ASSERT_TRUE(files_->Put(instance, tick, name, bytes).ok());
      records::ManifestFile& file = *manifest.add_files();
      file.set_name(name);
      file.set_size(bytes.size());
      file.set_hash(Sha256Hex(bytes));
    }
    const auto size = files_->Complete(instance, manifest);
    ASSERT_TRUE(size.ok()) << size.status();
  }
  std::vector<std::string> Keys() const {
    std::vector<std::string> keys;
    for (const auto& [key, bytes] : store_.Objects()) keys.push_back(key);
    return keys;
  }

  // One for all tests: CivetWeb takes two seconds to end.
  static FakeS3& Store() {
    static FakeS3 store;
    return store;
  }

  FakeS3& store_;
  S3Target* target_ = nullptr;
  std::unique_ptr<CheckpointFiles> files_;
};

TEST_F(S3TargetTest, KeepsWhatWasPutUnderItsPrefix) {
  Make("inst-1", 60);
  EXPECT_THAT(Keys(), ElementsAre("worlds/tessera/inst-1/60/manifest", "worlds/tessera/inst-1/60/region-1",
                                  "worlds/tessera/inst-1/60/region-2", "worlds/tessera/inst-1/60/scene"));
  EXPECT_TRUE(files_->Check("inst-1", 60).ok());
  EXPECT_EQ(*files_->Read("inst-1", 60, "region-2"), "region-2 at 60");
  EXPECT_EQ(files_->Check("inst-1", 61).code(), Code::kNotFound);
}

TEST_F(S3TargetTest, OneThatIsHalfMadeIsNoneAndCanBeAbandoned) {
  ASSERT_TRUE(files_->Put("inst-1", 60, "region-1", "half").ok());
  EXPECT_EQ(files_->Check("inst-1", 60).code(), Code::kNotFound);
  files_->Abandon("inst-1", 60);
  EXPECT_THAT(Keys(), IsEmpty());
  Make("inst-1", 120);
  files_->Abandon("inst-1", 120);
  EXPECT_TRUE(files_->Check("inst-1", 120).ok()) << "one that is published is not abandoned";
}

// A restored world makes the same ticks again. While its checkpoint is half made, the old manifest must not vouch for
// it.
TEST_F(S3TargetTest, OneOfTheSameTickIsReplacedAndNeverMixed) {
  Make("inst-1", 60);
  ASSERT_TRUE(files_->Put("inst-1", 60, "region-1", "another history").ok());
  EXPECT_EQ(files_->Check("inst-1", 60).code(), Code::kNotFound);
  Make("inst-1", 60);
  EXPECT_TRUE(files_->Check("inst-1", 60).ok());
}

TEST_F(S3TargetTest, RemovesOneAndAllAndListsInstancesPageByPage) {
  store_.page_size = 2;
  for (const std::string instance : {"inst-1", "inst-2", "inst-3", "inst-10", "inst-11"}) Make(instance, 60);
  Make("inst-1", 120);
  EXPECT_THAT(*files_->Instances(), ElementsAre("inst-1", "inst-10", "inst-11", "inst-2", "inst-3"));
  files_->Remove("inst-1", 60);
  EXPECT_EQ(files_->Check("inst-1", 60).code(), Code::kNotFound);
  EXPECT_TRUE(files_->Check("inst-1", 120).ok());
  files_->RemoveAll("inst-1");
  EXPECT_THAT(Keys(), Each(Not(HasSubstr("/inst-1/"))));
  EXPECT_TRUE(files_->Check("inst-10", 60).ok()) << "a name that begins alike is another world";
}

TEST_F(S3TargetTest, AMomentOfRefusalIsTriedAgain) {
  store_.fail_next = kS3Tries - 1;
  EXPECT_TRUE(files_->Put("inst-1", 60, "scene", "bytes").ok());
  EXPECT_TRUE(files_->CheckRoom(0).ok());
}

TEST_F(S3TargetTest, AStoreThatRefusesStopsCheckpointsAndSaysWhy) {
  store_.deny = true;
  const absl::Status put = files_->Put("inst-1", 60, "scene", "bytes");
  EXPECT_EQ(put.code(), Code::kPermissionDenied);
  EXPECT_THAT(std::string(put.message()), StartsWith("s3://worlds/tessera: DELETE inst-1/60/manifest: HTTP 403"));
  EXPECT_THAT(std::string(put.message()), HasSubstr("AccessDenied: said the store"));
  EXPECT_EQ(files_->CheckRoom(0), put);
  const std::size_t asked = store_.Requests().size();
  EXPECT_EQ(files_->Put("inst-1", 60, "scene", "bytes"), put) << "it is not asked each time";
  EXPECT_EQ(store_.Requests().size(), asked);
}

TEST_F(S3TargetTest, WrongCredentialsAndAnotherBucketAreSaidAtTheStart) {
  S3Settings wrong = store_.Settings(kAddress);
  wrong.secret_key = "not the key";
  const auto forged = S3Target::Open(wrong, kShort);
  EXPECT_EQ(forged.status().code(), Code::kPermissionDenied);
  EXPECT_THAT(std::string(forged.status().message()), HasSubstr("SignatureDoesNotMatch"));
  EXPECT_THAT(std::string(forged.status().message()), Not(HasSubstr("not the key"))) << "nothing secret";
  const auto other = S3Target::Open(store_.Settings("s3://others/tessera"), kShort);
  EXPECT_EQ(other.status().code(), Code::kNotFound);
  EXPECT_THAT(std::string(other.status().message()), HasSubstr("NoSuchBucket"));
}

// Control planes begin without their store of checkpoints: worlds run on.
TEST_F(S3TargetTest, AStoreThatIsAwayIsWaitedFor) {
  S3Settings away = store_.Settings(kAddress);
  away.endpoint = "http://127.0.0.1:1";
  const auto target = S3Target::Open(away, kShort);
  ASSERT_TRUE(target.ok()) << target.status();
  const absl::Status room = (*target)->CheckRoom(0);
  EXPECT_EQ(room.code(), Code::kUnavailable);
  EXPECT_THAT(std::string(room.message()), HasSubstr("http://127.0.0.1:1: "));
}

TEST_F(S3TargetTest, AnAnswerThatIsCutShortIsNotTakenForTheFile) {
  Make("inst-1", 60);
  store_.cut_answers = true;
  EXPECT_EQ(files_->Check("inst-1", 60).code(), Code::kUnavailable) << "it may be whole";
  store_.cut_answers = false;
  EXPECT_TRUE(files_->Check("inst-1", 60).ok());
}

TEST_F(S3TargetTest, WhatTheStoreDamagedIsNamed) {
  Make("inst-1", 60);
  store_.Damage("worlds/tessera/inst-1/60/region-2");
  const absl::Status status = files_->Check("inst-1", 60);
  EXPECT_EQ(status.code(), Code::kDataLoss);
  EXPECT_THAT(std::string(status.message()), HasSubstr("checkpoint 60 of inst-1: region-2: has another checksum"));
}

TEST_F(S3TargetTest, AStoreThatHangsIsGivenUp) {
  store_.Hang(true);
  const absl::Status put = target_->Put("inst-1", 60, "scene", "bytes");
  EXPECT_EQ(put.code(), Code::kUnavailable);
  store_.Hang(false);
}

TEST_F(S3TargetTest, StopEndsWhatWaits) {
  auto patient = S3Target::Open(store_.Settings(kAddress));  // 10 s, three times
  ASSERT_TRUE(patient.ok()) << patient.status();
  store_.Hang(true);
  auto put = std::async(std::launch::async, [&] { return (*patient)->Put("inst-1", 60, "scene", "bytes"); });
  (*patient)->Stop();
  EXPECT_EQ(put.get().code(), Code::kUnavailable);
  store_.Hang(false);
}

TEST_F(S3TargetTest, LargeFilesGoThereAndBack) {
  std::string large(std::size_t{9} << 20, 'x');
  for (std::size_t i = 0; i < large.size(); i += 4096) large[i] = static_cast<char>(i >> 12);
  ASSERT_TRUE(target_->Put("inst-1", 60, "region-1", large).ok());
  EXPECT_EQ(*target_->Read("inst-1", 60, "region-1"), large);
}

}  // namespace
}  // namespace tessera::control
