#include "host/files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <iterator>

#include "host/temporary_folder.h"

namespace tessera::host {
namespace {

using ::testing::HasSubstr;

class FilesTest : public testing::Test {
 protected:
  std::string File(const std::string& name) const { return folder_.path() + "/" + name; }
  static unsigned Mode(const std::string& path) {
    struct stat info {};
    EXPECT_EQ(stat(path.c_str(), &info), 0) << path;
    return info.st_mode & 0777;
  }
  std::size_t Entries() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder_.path()), {}));
  }

  TemporaryFolder folder_;
};

TEST_F(FilesTest, ReadsWhatWasWritten) {
  const std::string content("a\0b\n", 4);
  for (const Durability durability : {Durability::kSurvivesProcess, Durability::kSurvivesMachine}) {
    ASSERT_TRUE(WriteFile(File("f"), content, durability).ok());
    EXPECT_EQ(ReadFile(File("f"), 4).value(), content);
  }
  EXPECT_EQ(Mode(File("f")), 0600U);
  EXPECT_EQ(Entries(), 1U);  // no temporary file is left
}

TEST_F(FilesTest, ReadsFilesLargerThanOnePieceAndThoseThatClaimNoSize) {
  const std::string large(300'000, 'x');
  ASSERT_TRUE(WriteFile(File("f"), large, Durability::kSurvivesProcess).ok());
  EXPECT_EQ(ReadFile(File("f"), large.size()).value(), large);
  EXPECT_THAT(ReadFile("/proc/self/status", 1 << 20).value(), HasSubstr("VmRSS"));
}

TEST_F(FilesTest, RefusesAFileThatIsTooLarge) {
  ASSERT_TRUE(WriteFile(File("f"), "12345", Durability::kSurvivesProcess).ok());
  const absl::Status status = ReadFile(File("f"), 4).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(std::string(status.message()), File("f") + ": holds more than 4 bytes");
  EXPECT_FALSE(ReadFile("/dev/zero", 1000).ok());
}

TEST_F(FilesTest, ErrorsNameTheFile) {
  const absl::Status missing = ReadFile(File("missing"), 10).status();
  EXPECT_EQ(missing.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(std::string(missing.message()), File("missing") + ": No such file or directory");
  const absl::Status folder = ReadFile(folder_.path(), 10).status();
  EXPECT_EQ(folder.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(std::string(folder.message()), folder_.path() + ": Is a directory");
  EXPECT_THAT(std::string(WriteFile("/no/file", "x", Durability::kSurvivesProcess).message()), HasSubstr("/no/file: "));
  EXPECT_THAT(std::string(SyncFolder("/no/folder").message()), HasSubstr("/no/folder: "));
}

TEST_F(FilesTest, AFailedWriteLeavesTheOldContentAndNothingElse) {
  std::filesystem::create_directories(File("taken/by"));  // a file cannot be renamed to a folder
  const absl::Status status = WriteFile(File("taken"), "x", Durability::kSurvivesMachine);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Entries(), 1U);
}

TEST_F(FilesTest, MakesFoldersThatOnlyThisUserCanLookInto) {
  ASSERT_TRUE(MakePrivateFolder(File("a/b")).ok());
  EXPECT_EQ(Mode(File("a/b")), 0700U);
  ASSERT_TRUE(MakePrivateFolder(File("a/b")).ok());
  ASSERT_TRUE(WriteFile(File("a/file"), "", Durability::kSurvivesProcess).ok());
  EXPECT_THAT(std::string(MakePrivateFolder(File("a/file/b")).message()), HasSubstr(File("a/file/b")));
}

TEST(TemporaryFolderTest, VanishesWithAllInIt) {
  std::string path;
  {
    const TemporaryFolder folder;
    path = folder.path();
    ASSERT_TRUE(WriteFile(path + "/file", "x", Durability::kSurvivesProcess).ok());
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace tessera::host
