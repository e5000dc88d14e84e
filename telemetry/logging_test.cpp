#include "telemetry/logging.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
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
