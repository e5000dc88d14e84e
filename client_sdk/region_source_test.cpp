#include "client_sdk/region_source.h"

#include <gtest/gtest.h>

#include <vector>

#include "client_sdk/testing/test_now.h"

namespace tessera::client {
namespace {

constexpr RegionId kFirst{1}, kSecond{2}, kThird{3};

TEST(RegionSourceTest, StaysWithARegionThatSpeaks) {
  const std::vector<RegionId> all{kFirst, kSecond, kThird};
  RegionSource source;
  RegionSource::TimePoint now = kTestNow;
  EXPECT_FALSE(source.Choose(now, all, kSecond));
  EXPECT_TRUE(source.is(kSecond));
  for (int i = 0; i < 10; ++i) {
    now += RegionSource::kPatience - std::chrono::milliseconds(1);
    EXPECT_FALSE(source.Choose(now, all));
    EXPECT_TRUE(source.is(kSecond));
    source.Heard(now);
  }
}

TEST(RegionSourceTest, TriesAllInTurnsWhileTheyAreSilent) {
  const std::vector<RegionId> all{kFirst, kSecond, kThird};
  RegionSource source;
  RegionSource::TimePoint now = kTestNow;
  EXPECT_FALSE(source.Choose(now, all));
  for (const RegionId next : {kSecond, kThird, kFirst, kSecond}) {
    now += RegionSource::kPatience;
    EXPECT_TRUE(source.Choose(now, all, kThird));  // the preferred one only begins
    EXPECT_TRUE(source.is(next));
  }
}

TEST(RegionSourceTest, GoesOnWithTheNextWhenOneIsGone) {
  RegionSource source;
  EXPECT_FALSE(source.Choose(kTestNow, std::vector{kFirst, kSecond, kThird}, kSecond));
  EXPECT_FALSE(source.Choose(kTestNow, std::vector{kFirst, kThird}));  // at once, and nobody was silent
  EXPECT_TRUE(source.is(kThird));
  EXPECT_FALSE(source.Choose(kTestNow, std::vector<RegionId>{}));
  EXPECT_FALSE(source.is(kThird));
  EXPECT_FALSE(source.Choose(kTestNow, std::vector{kThird}, kFirst));  // it is not there
  EXPECT_TRUE(source.is(kThird));
}

}  // namespace
}  // namespace tessera::client
