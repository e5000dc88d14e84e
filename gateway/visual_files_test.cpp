// Meshes of a folder, given out by their hash and by nothing else.
#include "gateway/visual_files.h"

#include <gmock/gmock.h>

#include <atomic>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <optional>
#include <thread>

#include "core/world/sha256.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {
namespace {

using testing::HasSubstr;

class VisualFilesTest : public testing::Test {
 protected:
  std::string Put(const std::string& content) {
    const std::string sha256 = Sha256Hex(content);
    PutAs(sha256, content);
    return sha256;
  }
  void PutAs(const std::string& sha256, const std::string& content) {
    std::ofstream(folder_.path() + "/" + sha256 + ".glb", std::ios::binary) << content;
  }
  // The answer, once it is there.
  VisualFiles::Answer Get(const std::string& sha256) {
    std::optional<VisualFiles::Answer> answer;
    files_.Ask(sha256, [&](const VisualFiles::Answer& given) { answer = given; });
    while (!answer) {
      std::unique_lock lock(mutex_);
      woken_.wait(lock, [this] { return is_woken_; });
      is_woken_ = false;
      lock.unlock();
      files_.Finish();
    }
    return *answer;
  }
  std::string WhyNot(const std::string& sha256) { return std::string(Get(sha256).status().message()); }

  const host::TemporaryFolder folder_;
  std::mutex mutex_;
  std::condition_variable woken_;
  bool is_woken_ = false;
  VisualFiles files_{folder_.path(), [this] {
                       const std::lock_guard lock(mutex_);
                       is_woken_ = true;
                       woken_.notify_one();
                     }};
};

TEST_F(VisualFilesTest, AFileIsGivenByItsHash) {
  const std::string sha256 = Put("glTF and more");
  const auto first = Get(sha256);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(**first, "glTF and more");
  PutAs(sha256, "changed");
  const auto again = Get(sha256);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(**again, "glTF and more") << "it is kept";
}

TEST_F(VisualFilesTest, AFileWithAnotherHashIsNotGiven) {
  const std::string sha256 = Sha256Hex("whole");
  PutAs(sha256, "whol");
  EXPECT_EQ(Get(sha256).status().code(), absl::StatusCode::kDataLoss);
  PutAs(sha256, "whole");
  EXPECT_THAT(WhyNot(sha256), HasSubstr("is damaged: it has another hash")) << "it is not read anew at once";
  EXPECT_THAT(WhyNot(Sha256Hex("none")), HasSubstr("has no file"));
}

TEST_F(VisualFilesTest, WithoutAFolderThereIsNone) {
  VisualFiles none("", [] {});
  std::string why;
  none.Ask(Sha256Hex("x"), [&](const VisualFiles::Answer& answer) { why = std::string(answer.status().message()); });
  EXPECT_EQ(why, "this gateway has no --visuals");
}

// The answer of files that are given this way, once it is there.
VisualFiles::Answer Fetched(VisualFiles& files, const std::string& sha256) {
  std::optional<VisualFiles::Answer> answer;
  files.Ask(sha256, [&](const VisualFiles::Answer& given) { answer = given; });
  while (!answer) {
    std::this_thread::yield();
    files.Finish();
  }
  return *answer;
}

TEST_F(VisualFilesTest, OneThatTheFolderLacksIsFetched) {
  std::atomic<int> fetched{0};
  VisualFiles files(
      folder_.path(), [] {},
      [&](const std::string& sha256) -> absl::StatusOr<std::string> {
        ++fetched;
        if (sha256 == Sha256Hex("elsewhere")) return "elsewhere";
        return absl::NotFoundError("the control plane has none");
      });
  const std::string here = Put("here"), damaged = Sha256Hex("whole");
  EXPECT_EQ(**Fetched(files, here), "here");
  EXPECT_EQ(fetched, 0);
  EXPECT_EQ(**Fetched(files, Sha256Hex("elsewhere")), "elsewhere");
  EXPECT_EQ(**Fetched(files, Sha256Hex("elsewhere")), "elsewhere");
  EXPECT_EQ(fetched, 1);
  PutAs(damaged, "whol");
  EXPECT_EQ(Fetched(files, damaged).status().code(), absl::StatusCode::kDataLoss) << "nobody has it";
}

TEST_F(VisualFilesTest, OneThatCouldNotBeFetchedIsNotAskedForAgainAtOnce) {
  std::atomic<int> fetched{0};
  VisualFiles files(
      "", [] {},
      [&](const std::string&) -> absl::StatusOr<std::string> {
        ++fetched;
        return absl::UnavailableError("it does not answer");
      });
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(absl::IsUnavailable(Fetched(files, Sha256Hex("x")).status()));
  EXPECT_EQ(fetched, 1);
}

TEST_F(VisualFilesTest, ManyWhoAskAtOnceAreAllAnswered) {
  const std::string sha256 = Put("once");
  int answered = 0;
  for (int i = 0; i < 5; ++i) {
    files_.Ask(sha256, [&](const VisualFiles::Answer& answer) { answered += answer.ok() ? 1 : 0; });
  }
  EXPECT_TRUE(Get(sha256).ok());
  EXPECT_EQ(answered, 5);
}

}  // namespace
}  // namespace tessera::gateway
