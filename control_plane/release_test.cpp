#include "control_plane/release.h"

#include <gmock/gmock.h>

#include <string>

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

TEST(ReleaseTest, NeighboursWorkTogether) {
  for (const char* agent : {"0.1.0", "0.1.9", "0.2.0", "0.0.3"})
    EXPECT_TRUE(CheckRelease(agent, "0.1.4").ok()) << agent;
  for (const char* agent : {"2.7.1", "1.0.0", "3.0.0"}) EXPECT_TRUE(CheckRelease(agent, "2.0.0").ok()) << agent;
  EXPECT_TRUE(CheckRelease("0.9.0", "1.0.0").ok());
}

TEST(ReleaseTest, ThoseFurtherApartAreRefusedByName) {
  const absl::Status refused = CheckRelease("0.3.0", "0.1.0");
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("an agent of release 0.3.0"));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("0.1.0"));
  EXPECT_FALSE(CheckRelease("0.1.0", "0.3.0").ok());
  EXPECT_FALSE(CheckRelease("1.0.0", "3.0.0").ok());
}

TEST(ReleaseTest, WhatIsNoReleaseIsSaidToBeNone) {
  for (const char* agent : {"", "0.1", "1.x.0", "-1.0.0", "0.1.0.0"}) {
    EXPECT_EQ(CheckRelease(agent, "0.1.0").code(), absl::StatusCode::kInvalidArgument) << agent;
  }
  EXPECT_TRUE(CheckRelease("anything", "").ok());
}

}  // namespace
}  // namespace tessera::control
