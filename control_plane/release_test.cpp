#include "control_plane/release.h"

#include <gmock/gmock.h>

#include <cstddef>
#include <string>
#include <vector>

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

TEST(ReleaseTest, AreOrderedByTheirNumbers) {
  const std::vector<const char*> ascending{"anything", "0.1.0", "0.1.2", "0.1.10", "0.2.0", "0.10.0", "1.0.0", "2.0.0"};
  for (std::size_t i = 0; i < ascending.size(); ++i) {
    for (std::size_t j = 0; j < ascending.size(); ++j) {
      EXPECT_EQ(IsOlderRelease(ascending[i], ascending[j]), i < j) << ascending[i] << " and " << ascending[j];
    }
  }
}

TEST(ReleaseTest, AHostListsAFewAndNothingElse) {
  google::protobuf::RepeatedPtrField<std::string> releases;
  EXPECT_TRUE(CheckReleases(releases).ok());
  for (int i = 0; i < kMaxReleases; ++i) releases.Add("0." + std::to_string(i) + ".0");
  EXPECT_TRUE(CheckReleases(releases).ok());
  *releases.Mutable(3) = "../../bin";
  EXPECT_EQ(CheckReleases(releases).message(), "hello.releases: \"../../bin\" is no release");
  *releases.Mutable(3) = "0.3.0" + std::string(100, '0');
  EXPECT_EQ(CheckReleases(releases).code(), absl::StatusCode::kInvalidArgument);
  *releases.Mutable(3) = "0.3.0";
  releases.Add("0.99.0");
  EXPECT_EQ(CheckReleases(releases).message(), "hello.releases: has 17 entries, at most 16");
}

}  // namespace
}  // namespace tessera::control
