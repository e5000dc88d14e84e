#include "host/log_rotation.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "host/last_lines.h"
#include "host/temporary_folder.h"

namespace tessera::host {
namespace {

namespace fs = std::filesystem;

class LogRotationTest : public ::testing::Test {
 protected:
  const TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/worker.log";
};

TEST_F(LogRotationTest, ASmallLogStays) {
  std::ofstream(path_) << std::string(kMaxLogBytes - 1, 'x');
  EXPECT_FALSE(RotateLogIfLarge(path_));
  EXPECT_TRUE(fs::exists(path_));
  EXPECT_FALSE(RotateLogIfLarge(folder_.path() + "/none"));
}

TEST_F(LogRotationTest, LogsAreFewAndTheEldestGoes) {
  for (int i = 0; i < kEarlierLogs + 3; ++i) {
    std::ofstream(path_) << std::string(kMaxLogBytes, 'x') << "\nlog " << i << "\n";
    EXPECT_TRUE(RotateLogIfLarge(path_));
    EXPECT_FALSE(fs::exists(path_));
  }
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder_.path())) files += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(files, static_cast<std::size_t>(kEarlierLogs));
  for (int number = 1; number <= kEarlierLogs; ++number) {
    EXPECT_EQ(LastLines(EarlierLog(path_, number), 1).at(0), "log " + std::to_string(kEarlierLogs + 3 - number));
  }
}

TEST_F(LogRotationTest, TheLastLinesGoBackIntoTheLogBefore) {
  std::ofstream(EarlierLog(path_, 1)) << "one\ntwo\nthree\n";
  std::ofstream(path_) << "four\n";
  EXPECT_EQ(LastLines(path_, 3), (std::vector<std::string>{"two", "three", "four"}));
  EXPECT_EQ(LastLines(path_, 1), (std::vector<std::string>{"four"}));
  fs::remove(path_);
  EXPECT_EQ(LastLines(path_, 1), (std::vector<std::string>{"three"})) << "between the rename and the new file";
}

TEST_F(LogRotationTest, KnowsEarlierLogs) {
  EXPECT_TRUE(IsEarlierLogOf("/l/a.log.1", "/l/a.log"));
  EXPECT_FALSE(IsEarlierLogOf("/l/a.log", "/l/a.log"));
  EXPECT_FALSE(IsEarlierLogOf("/l/a.log.10", "/l/a.log"));
  EXPECT_FALSE(IsEarlierLogOf("/l/b.log.1", "/l/a.log"));
}

}  // namespace
}  // namespace tessera::host
