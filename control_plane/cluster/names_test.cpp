#include "control_plane/cluster/names.h"

#include <gmock/gmock.h>

#include "control_plane/control_settings.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

TEST(NamesTest, ANameIsLowerCaseWithDashesBetween) {
  for (const std::string& name : {std::string("a"), std::string("alpha-7"), std::string(kMaxNameBytes, 'a')}) {
    EXPECT_TRUE(CheckName(name).ok()) << name;
  }
  for (const std::string& name : {std::string(), std::string("Alpha"), std::string("-a"), std::string("a-"),
                                  std::string("a b"), std::string(kMaxNameBytes + 1, 'a')}) {
    EXPECT_EQ(CheckName(name).code(), absl::StatusCode::kInvalidArgument) << name;
  }
  EXPECT_THAT(std::string(CheckName("a\nb").message()), HasSubstr("name: \"a b\" is not 1 to 63"));
}

TEST(NamesTest, APrefixOfInstancesMayEndAnywhere) {
  for (const std::string& prefix : {std::string(), std::string("inst-"), std::string("inst-7")}) {
    EXPECT_TRUE(CheckInstances(prefix).ok()) << prefix;
  }
  for (const std::string& prefix : {std::string("inst_7"), std::string("*"), std::string(kMaxNameBytes + 1, 'a')}) {
    EXPECT_EQ(CheckInstances(prefix).code(), absl::StatusCode::kInvalidArgument) << prefix;
  }
  EXPECT_THAT(std::string(CheckInstances("*").message()), HasSubstr("instances: \"*\" does not begin"));
}

}  // namespace
}  // namespace tessera::control
