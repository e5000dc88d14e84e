#include "host/last_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "host/temporary_folder.h"

namespace tessera::host {
namespace {

using ::testing::ElementsAre;

TEST(LastLinesTest, AreTheLastAndPrintable) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/log";
  EXPECT_TRUE(LastLines(path, 3).empty());
  std::ofstream(path) << "one\ntwo\nthree\nfour";
  EXPECT_THAT(LastLines(path, 3), ElementsAre("two", "three", "four"));
  EXPECT_THAT(LastLines(path, 9), ElementsAre("one", "two", "three", "four"));
  EXPECT_EQ(LastLinesText(path, 2), "\n  three\n  four");
  std::ofstream(path) << "\xff\x01"
                      << "a\tb\n";
  EXPECT_THAT(LastLines(path, 3), ElementsAre("??a b"));
}

TEST(LastLinesTest, AreBoundedWhateverTheFileHolds) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/log";
  std::ofstream(path) << std::string(100'000, 'x') << "\nend\n";
  const auto lines = LastLines(path, 20);
  ASSERT_FALSE(lines.empty());
  EXPECT_EQ(lines.back(), "end");
  for (const auto& line : lines) EXPECT_LE(line.size(), kMaxLineBytes);
}

}  // namespace
}  // namespace tessera::host
