#include "control_plane/cluster_mark.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "control_plane/memory_store.h"
#include "host/temporary_folder.h"

namespace tessera::control {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// A bucket of which only the mark is used, and that may not answer.
class MarkedBucket final : public CheckpointTarget {
 public:
  struct State {
    std::optional<std::string> mark;
    absl::Status fault;
    int reads = 0;
  };
  MarkedBucket(std::string name, State& state) : name_(std::move(name)), state_(state) {}

  const std::string& name() const override { return name_; }
  absl::Status CheckRoom(std::uint64_t /*bytes*/) override { return absl::OkStatus(); }
  absl::Status Put(const std::string& /*instance*/, std::uint64_t /*tick*/, const std::string& /*file*/,
                   const std::string& /*bytes*/) override {
    return state_.fault;
  }
  absl::Status Publish(const std::string& /*instance*/, std::uint64_t /*tick*/, const std::string& manifest) override {
    if (state_.fault.ok()) state_.mark = manifest;
    return state_.fault;
  }
  void Abandon(const std::string& /*instance*/, std::uint64_t /*tick*/) override {}
  absl::StatusOr<std::string> Read(const std::string& /*instance*/, std::uint64_t /*tick*/,
                                   const std::string& /*file*/) override {
    ++state_.reads;
    if (!state_.fault.ok()) return state_.fault;
    if (!state_.mark) return absl::NotFoundError("is not there");
    return *state_.mark;
  }
  void Remove(const std::string& /*instance*/, std::uint64_t /*tick*/) override {}
  void RemoveAll(const std::string& /*instance*/) override {}
  std::string DraftFolder() const override { return ""; }
  absl::StatusOr<std::vector<std::string>> Instances() override {
    if (!state_.fault.ok()) return state_.fault;
    return std::vector<std::string>{"cluster", "inst-7"};
  }

 private:
  const std::string name_;
  State& state_;
};

class ClusterMarkTest : public ::testing::Test {
 protected:
  // As if a world had checkpoints there.
  static void KeepWorld(const std::string& folder) { std::filesystem::create_directories(folder + "/inst-3/1200"); }
  absl::Status Meet(Store& store, const std::string& folder) {
    const auto files = CheckpointFiles::Open(folder);
    EXPECT_TRUE(files.ok()) << files.status();
    return Meet(store, **files);
  }
  absl::Status Meet(Store& store, const CheckpointFiles& files) {
    return CheckBelongTogether(store, files, "control.db",
                               [this](std::size_t n) { return std::string(n, static_cast<char>(++random_)); });
  }
  absl::Status MeetBucket(Store& store, const std::string& name, MarkedBucket::State& bucket) {
    return Meet(store, CheckpointFiles(std::make_unique<MarkedBucket>(name, bucket)));
  }
  static MemoryStore& Used(MemoryStore& store) {
    EXPECT_TRUE(store.Put("counters", "x", kAbsent).ok());
    return store;
  }

  host::TemporaryFolder folder_;
  std::string first_ = folder_.path() + "/first", second_ = folder_.path() + "/second";
  int random_ = 0;
};

TEST_F(ClusterMarkTest, AStoreOfAnotherClusterIsRefusedByName) {
  MemoryStore ours, others;
  ASSERT_TRUE(Meet(ours, first_).ok());
  ASSERT_TRUE(Meet(others, second_).ok());
  KeepWorld(first_);
  EXPECT_TRUE(Meet(ours, first_).ok());
  const absl::Status refused = Meet(others, first_);
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()),
              AllOf(HasSubstr(first_ + " holds checkpoints of cluster 0101010101010101, inst-3 among them, but "
                                       "control.db is that of cluster 0202020202020202: put the store of those"),
                    HasSubstr("by --checkpoints")));
  EXPECT_TRUE(Meet(ours, first_).ok()) << "nothing was changed by it";
}

TEST_F(ClusterMarkTest, AnEmptyStoreBesideCheckpointsIsRefused) {
  MemoryStore store;
  KeepWorld(first_);
  EXPECT_EQ(Meet(store, first_).message(),
            first_ +
                " holds checkpoints of inst-3, but control.db is empty: put the store back, or, for a new "
                "cluster, move the checkpoints away");
  EXPECT_EQ(store.revision(), 0);
  EXPECT_FALSE(std::filesystem::exists(first_ + "/cluster"));
}

// From before there were marks, and by a new folder: each takes the other's.
TEST_F(ClusterMarkTest, WhatHasNoMarkTakesTheOthers) {
  MemoryStore old;
  ASSERT_TRUE(old.Put("counters", "x", kAbsent).ok());
  KeepWorld(first_);
  ASSERT_TRUE(Meet(old, first_).ok());
  ASSERT_TRUE(Meet(old, second_).ok()) << "the checkpoints lie elsewhere now";
  KeepWorld(second_);
  MemoryStore from_a_backup_of_before;
  ASSERT_TRUE(from_a_backup_of_before.Put("counters", "x", kAbsent).ok());
  EXPECT_TRUE(Meet(from_a_backup_of_before, second_).ok());
  EXPECT_EQ(from_a_backup_of_before.Get(kClusterKey)->value, old.Get(kClusterKey)->value);
}

TEST_F(ClusterMarkTest, AFolderWithoutWorldsIsAnybodys) {
  MemoryStore one, two;
  ASSERT_TRUE(Meet(one, first_).ok());
  ASSERT_TRUE(Meet(two, first_).ok());
  KeepWorld(first_);
  EXPECT_FALSE(Meet(one, first_).ok());
}

TEST_F(ClusterMarkTest, AStoreThatCannotBeWrittenIsMarkedAnotherTime) {
  MemoryStore store;
  Used(store).FailNext(1);
  EXPECT_TRUE(Meet(store, first_).ok());
  EXPECT_TRUE(Meet(store, first_).ok());
  EXPECT_EQ(store.Get(kClusterKey)->value, "0101010101010101") << "as the folder was marked";
}

// A leader that begins waits for no bucket that it knows.
TEST_F(ClusterMarkTest, ABucketThatIsThisClustersIsNotAskedAgain) {
  MemoryStore ours, others;
  MarkedBucket::State bucket, second;
  ASSERT_TRUE(MeetBucket(Used(ours), "s3://one/x", bucket).ok());
  EXPECT_EQ(bucket.reads, 1);
  bucket.fault = absl::UnavailableError("does not answer");
  EXPECT_TRUE(MeetBucket(ours, "s3://one/x", bucket).ok());
  EXPECT_EQ(bucket.reads, 1);
  bucket.fault = absl::OkStatus();
  ASSERT_TRUE(MeetBucket(ours, "s3://two/x", second).ok()) << "the checkpoints lie elsewhere now";
  EXPECT_EQ(second.reads, 1);
  EXPECT_TRUE(MeetBucket(Used(others), "s3://one/x", bucket).ok()) << "it has no mark of its own";
  EXPECT_EQ(others.Get(kClusterKey)->value, ours.Get(kClusterKey)->value.substr(0, 16) + " s3://one/x");
}

TEST_F(ClusterMarkTest, ABucketOfAnotherClusterIsRefusedAndOneThatDoesNotAnswerIsNot) {
  MemoryStore ours, others;
  MarkedBucket::State first, second;
  ASSERT_TRUE(MeetBucket(Used(ours), "s3://one/x", first).ok());
  ASSERT_TRUE(MeetBucket(Used(others), "s3://two/x", second).ok());
  first.fault = absl::UnavailableError("does not answer");
  EXPECT_TRUE(MeetBucket(others, "s3://one/x", first).ok());
  first.fault = absl::OkStatus();
  EXPECT_THAT(std::string(MeetBucket(others, "s3://one/x", first).message()),
              HasSubstr("s3://one/x holds checkpoints of cluster 0101010101010101, inst-7 among them"));
}

}  // namespace
}  // namespace tessera::control
