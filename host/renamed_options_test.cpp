#include "host/renamed_options.h"

#include <vector>

#include "gtest/gtest.h"

namespace tessera::host {
namespace {

std::string Refused(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "program");
  return RefusedOption(static_cast<int>(arguments.size()), arguments.data());
}

TEST(RenamedOptionsTest, AnOldNameIsAnsweredWithTheNewOne) {
  EXPECT_EQ(Refused({"--listen", "x", "--data-dir", "y"}), "--data-dir is called --state-dir now");
  EXPECT_EQ(Refused({"--log=debug"}), "--log is called --log-level now");
}

TEST(RenamedOptionsTest, OtherArgumentsPass) {
  EXPECT_EQ(Refused({}), "");
  EXPECT_EQ(Refused({"--log-level", "debug", "--log-file=x", "data-dir"}), "");
  EXPECT_EQ(Refused({"set-property", "--", "--json"}), "");
}

}  // namespace
}  // namespace tessera::host
