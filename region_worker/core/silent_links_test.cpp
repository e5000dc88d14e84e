#include "region_worker/core/silent_links.h"

#include <gtest/gtest.h>

#include "region_worker/testing/regions.h"
#include "region_worker/testing/small_world.h"

namespace tessera::worker {
namespace {

class SilentLinksTest : public ::testing::Test {
 protected:
  SilentLinksTest() {
    links.Up(kSecond, Incarnation(1), kStart, actions);
    Look();
  }
  void Look(const std::vector<RegionId>& closed = {kSecond}) { silent.Look(closed, links, now); }
  // As a running worker looks, for so long.
  void Pass(Duration span, const std::vector<RegionId>& closed = {kSecond}) {
    for (const TimePoint end = now + span; now < end;) {
      now += SilentLinks::kInterval;
      ASSERT_TRUE(silent.Due(now));
      Look(closed);
    }
  }
  bool IsSilent() const { return silent.Is(kSecond, links); }

  SilentLinks silent;
  LinkTable links{kSelf};
  Actions actions;
  TimePoint now = kStart;
};

TEST_F(SilentLinksTest, ANeighbourWithAClosedBorderIsSilentOnceNothingHasComeForLongEnough) {
  EXPECT_FALSE(silent.Due(now + SilentLinks::kInterval / 2));
  Pass(SilentLinks::kSilence - SilentLinks::kInterval);
  EXPECT_FALSE(IsSilent());
  Pass(SilentLinks::kInterval);
  EXPECT_TRUE(IsSilent());
  EXPECT_NE(links.LinkTo(kSecond), 0U) << "the link is as it was";
  EXPECT_TRUE(AllOf<CutLink>(actions).empty());
}

TEST_F(SilentLinksTest, OneThatIsHeardIsNotSilentAtOnceAndTheCountBeginsAnew) {
  Pass(2 * SilentLinks::kSilence);
  ASSERT_TRUE(IsSilent());
  now += std::chrono::milliseconds(1);
  links.Heard(kSecond, now);
  EXPECT_FALSE(IsSilent()) << "before the next look";
  Look();
  Pass(SilentLinks::kSilence - SilentLinks::kInterval);
  EXPECT_FALSE(IsSilent());
  Pass(SilentLinks::kInterval);
  EXPECT_TRUE(IsSilent());
}

TEST_F(SilentLinksTest, OneThatIsHeardNowAndThenIsNotSilent) {
  for (int i = 0; i < 10; ++i) {
    Pass(SilentLinks::kSilence - SilentLinks::kInterval);
    EXPECT_FALSE(IsSilent());
    links.Heard(kSecond, now);
  }
}

TEST_F(SilentLinksTest, WhereTheBorderIsOpenNothingIsDue) {
  Pass(10 * SilentLinks::kSilence, {});
  EXPECT_FALSE(IsSilent());
  Pass(2 * SilentLinks::kSilence);
  ASSERT_TRUE(IsSilent());
  Pass(SilentLinks::kInterval, {});
  EXPECT_FALSE(IsSilent());
}

TEST_F(SilentLinksTest, TimeInWhichThisProcessStoodStillProvesNothing) {
  now += std::chrono::minutes(1);
  Look();
  EXPECT_FALSE(IsSilent());
  Pass(SilentLinks::kSilence - SilentLinks::kLongestLook - SilentLinks::kInterval);
  EXPECT_FALSE(IsSilent());
  Pass(SilentLinks::kInterval);
  EXPECT_TRUE(IsSilent());
}

TEST_F(SilentLinksTest, OneThatWasSilentBeforeThisProcessStoodStillIsSilentAfterIt) {
  Pass(SilentLinks::kSilence);
  now += std::chrono::minutes(1);
  Look();
  EXPECT_TRUE(IsSilent());
}

TEST_F(SilentLinksTest, ANewLinkIsASign) {
  Pass(SilentLinks::kSilence);
  links.Down(kSecond);
  EXPECT_TRUE(IsSilent());
  links.Up(kSecond, Incarnation(1), now, actions);
  EXPECT_FALSE(IsSilent());
}

}  // namespace
}  // namespace tessera::worker
