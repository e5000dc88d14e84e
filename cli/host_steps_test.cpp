// The steps of `tessera host add` are those of the manual.
#include "cli/host_steps.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>
#include <string>

#include "absl/strings/str_replace.h"

namespace tessera::cli {
namespace {

using ::testing::HasSubstr;

// The manual's section "Add a host".
std::string Section() {
  std::ifstream in(TESSERA_SOURCE_DIR "/docs/operating.md");
  std::stringstream text;
  text << in.rdbuf();
  const std::string all = text.str();
  const std::size_t begin = all.find("\n## Add a host\n");
  EXPECT_NE(begin, std::string::npos);
  return all.substr(begin, all.find("\n## ", begin + 1) - begin);
}

TEST(HostStepsTest, EachStepWithThePackageStandsInTheManual) {
  const std::string section = Section();
  std::istringstream lines(HostSteps("10.0.0.1:7700"));
  int steps = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("only where there is no package")) break;
    if (!line.starts_with("  ")) continue;
    ++steps;
    EXPECT_THAT(section, HasSubstr("\n" + absl::StrReplaceAll(line.substr(2), {{"ADDRESS", "10.0.0.2"}}) + "\n"));
  }
  EXPECT_EQ(steps, 5);
}

// An agent that root starts by hand would leave a folder that the unit's user cannot enter.
TEST(HostStepsTest, ByHandIsTheLastAndInAFolderOfItsOwn) {
  const std::string steps = HostSteps("10.0.0.1:7700,10.0.0.2:7700");
  const std::size_t by_hand = steps.find("only where there is no package");
  ASSERT_NE(by_hand, std::string::npos);
  EXPECT_EQ(steps.find("TESSERA_JOIN_TOKEN"), steps.rfind("TESSERA_JOIN_TOKEN"));
  EXPECT_GT(steps.find("TESSERA_JOIN_TOKEN"), by_hand);
  EXPECT_THAT(steps.substr(by_hand), HasSubstr("--control 10.0.0.1:7700,10.0.0.2:7700 --advertise-address ADDRESS"));
  EXPECT_THAT(steps.substr(by_hand), HasSubstr("--state-dir FOLDER"));
}

}  // namespace
}  // namespace tessera::cli
