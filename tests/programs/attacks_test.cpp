// docs/security.md names tests for each kind of attacker: all of them are there, and no row has none.
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "host/files.h"

namespace tessera::programs {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxAttacksBytes = 1 << 20;

std::set<std::string> TestsOfTheTree() {
  static const std::regex kTest("\\nTEST(?:_F|_P)?\\((\\w+), (\\w+)\\)");
  std::set<std::string> tests;
  const fs::path root = TESSERA_SOURCE_DIR;
  for (const char* folder : {"agent", "control_plane", "gateway", "host", "net", "region_worker", "tests"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder)) {
      if (!entry.path().string().ends_with("_test.cpp")) continue;
      const std::string text = host::ReadFile(entry.path().string(), kMaxAttacksBytes).value();
      for (std::sregex_iterator it(text.begin(), text.end(), kTest), end; it != end; ++it) {
        tests.insert((*it)[1].str() + "." + (*it)[2].str());
      }
    }
  }
  return tests;
}

TEST(AttacksTest, EachRowNamesTestsThatExist) {
  const std::string document =
      host::ReadFile(std::string(TESSERA_SOURCE_DIR) + "/docs/security.md", kMaxAttacksBytes).value();
  const std::size_t begin = document.find("\n## Attacks\n");
  ASSERT_NE(begin, std::string::npos);
  std::istringstream lines(document.substr(begin + 1, document.find("\n## ", begin + 1) - begin));
  const std::set<std::string> known = TestsOfTheTree();
  static const std::regex kName("`(\\w+Test\\.\\w+)`");
  int rows = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("| ", 0) != 0 || line.rfind("| attacker", 0) == 0) continue;
    ++rows;
    int named = 0;
    for (std::sregex_iterator it(line.begin(), line.end(), kName), end; it != end; ++it, ++named) {
      EXPECT_TRUE(known.contains((*it)[1].str())) << "there is no test " << (*it)[1] << ": " << line;
    }
    EXPECT_GT(named, 0) << line;
  }
  EXPECT_GE(rows, 29) << "kinds of attacks that the project tests";
}

}  // namespace
}  // namespace tessera::programs
