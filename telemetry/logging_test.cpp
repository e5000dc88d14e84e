#include "telemetry/logging.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "host/last_lines.h"
#include "host/log_rotation.h"
#include "host/temporary_folder.h"
#include "spdlog/spdlog.h"

namespace tessera::telemetry {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

class LoggingTest : public ::testing::Test {
 protected:
  void SetUp() override { unsetenv(kLogEnvironment); }
  void TearDown() override { unsetenv(kLogEnvironment); }
};

TEST_F(LoggingTest, WritesTimeLevelComponentAndMessageToStderr) {
  ASSERT_TRUE(InitLogging("region").ok());
  ::testing::internal::CaptureStderr();
  spdlog::info("handover out body={} to={}", 17, 2);
  EXPECT_THAT(
      ::testing::internal::GetCapturedStderr(),
      MatchesRegex("[0-9]+-[0-9]+-[0-9]+T[0-9]+:[0-9]+:[0-9]+\\.[0-9]+Z info region: handover out body=17 to=2\n"));
}

TEST_F(LoggingTest, DropsWhatIsBelowItsLevel) {
  ASSERT_TRUE(InitLogging("region", "warning").ok());
  ::testing::internal::CaptureStderr();
  spdlog::info("quiet");
  spdlog::warn("loud");
  const std::string text = ::testing::internal::GetCapturedStderr();
  EXPECT_THAT(text, ::testing::Not(HasSubstr("quiet")));
  EXPECT_THAT(text, HasSubstr("warning region: loud"));
}

TEST_F(LoggingTest, GivesTheJournalThePriorityOfALineAndNobodyElse) {
  ::testing::internal::CaptureStderr();
  struct stat opened {};
  ASSERT_EQ(fstat(STDERR_FILENO, &opened), 0);
  setenv("JOURNAL_STREAM", (std::to_string(opened.st_dev) + ":" + std::to_string(opened.st_ino)).c_str(), 1);
  ASSERT_TRUE(InitLogging("region").ok());
  spdlog::warn("slow");
  spdlog::error("full");
  setenv("JOURNAL_STREAM", (std::to_string(opened.st_dev) + ":1").c_str(), 1);  // inherited from a service
  ASSERT_TRUE(InitLogging("region").ok());
  spdlog::error("alone");
  unsetenv("JOURNAL_STREAM");
  const std::string text = ::testing::internal::GetCapturedStderr();
  EXPECT_THAT(text, MatchesRegex("<4>[^\n]*region: slow\n<3>[^\n]*region: full\n2[^\n]*region: alone\n"));
}

TEST_F(LoggingTest, FlagWinsOverEnvironment) {
  setenv(kLogEnvironment, "off", 1);
  ASSERT_TRUE(InitLogging("region").ok());
  EXPECT_EQ(spdlog::default_logger()->level(), spdlog::level::off);
  ASSERT_TRUE(InitLogging("region", "debug").ok());
  EXPECT_EQ(spdlog::default_logger()->level(), spdlog::level::debug);
}

TEST_F(LoggingTest, RefusesAnUnknownLevelAndNamesItsSource) {
  const absl::Status by_flag = InitLogging("region", "loud");
  EXPECT_EQ(by_flag.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(by_flag.message()), HasSubstr("--log-level: unknown log level loud"));
  setenv(kLogEnvironment, "very loud", 1);
  EXPECT_THAT(std::string(InitLogging("region").message()), HasSubstr("TESSERA_LOG: unknown log level \"very loud\""));
}

// stderr as the file at `path`, for as long as this lives.
class StderrInFile {
 public:
  explicit StderrInFile(const std::string& path) : before_(dup(STDERR_FILENO)) {
    const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    dup2(fd, STDERR_FILENO);
    close(fd);
  }
  ~StderrInFile() {
    std::fflush(stderr);
    dup2(before_, STDERR_FILENO);
    close(before_);
  }
  StderrInFile(const StderrInFile&) = delete;
  StderrInFile& operator=(const StderrInFile&) = delete;

 private:
  int before_;
};

TEST_F(LoggingTest, ItsLogFileNeverGrowsBeyondItsLimitAndOldOnesGo) {
  const host::TemporaryFolder folder;
  const std::string path = folder.path() + "/a.log";
  setenv(host::kLogFileEnvironment, path.c_str(), 1);
  {
    const StderrInFile in_file(path);
    ASSERT_TRUE(InitLogging("region").ok());
    const std::string line(64 * 1024, 'x');
    const std::uint64_t lines = (host::kEarlierLogs + 2) * host::kMaxLogBytes / line.size();
    for (std::uint64_t i = 0; i < lines; ++i) spdlog::info(line);
    spdlog::info("the last");
  }
  unsetenv(host::kLogFileEnvironment);
  ASSERT_TRUE(InitLogging("region").ok());
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    ++files;
    EXPECT_LT(entry.file_size(), host::kMaxLogBytes + 128 * 1024) << entry.path();
  }
  EXPECT_EQ(files, host::kEarlierLogs + 1);
  EXPECT_THAT(host::LastLines(path, 1).at(0), HasSubstr("the last"));
}

// Somebody else writes there, too, or it is no file at all.
TEST_F(LoggingTest, AFileThatIsNotItsStderrStays) {
  const host::TemporaryFolder folder;
  const std::string path = folder.path() + "/a.log", other = folder.path() + "/other.log";
  std::ofstream(path) << std::string(host::kMaxLogBytes, 'x');
  setenv(host::kLogFileEnvironment, path.c_str(), 1);
  {
    const StderrInFile in_file(other);
    ASSERT_TRUE(InitLogging("region").ok());
    spdlog::info("elsewhere");
  }
  unsetenv(host::kLogFileEnvironment);
  ASSERT_TRUE(InitLogging("region").ok());
  EXPECT_FALSE(std::filesystem::exists(host::EarlierLog(path, 1)));
  EXPECT_THAT(host::LastLines(other, 1).at(0), HasSubstr("elsewhere"));
}

TEST(LogValueTest, LeavesPlainTextAsItIs) { EXPECT_EQ(LogValue("plaza-1/region:2"), "plaza-1/region:2"); }

TEST(LogValueTest, QuotesWhatCouldForgeALineOrAKey) {
  EXPECT_EQ(LogValue(""), "\"\"");
  EXPECT_EQ(LogValue("a b"), "\"a b\"");
  EXPECT_EQ(LogValue("x=1"), "\"x=1\"");
  EXPECT_EQ(LogValue("a\nb\r\t"), "\"a\\nb\\r\\t\"");
  EXPECT_EQ(LogValue("\x1b[31m\"\\"), "\"\\x1b[31m\\\"\\\\\"");
}

}  // namespace
}  // namespace tessera::telemetry
