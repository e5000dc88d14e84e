#include "region_worker/core/neighbour_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "region_worker/testing/regions.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class NeighbourWatchTest : public ::testing::Test {
 protected:
  NeighbourWatchTest() { links.Up(kSecond, Incarnation(1), kStart, actions); }
  std::vector<RegionId> Look(TimePoint now, const std::vector<RegionId>& waited_for = {kSecond}) {
    std::vector<RegionId> silent;
    for (const SilentNeighbour& neighbour : watch.Look(waited_for, links, now)) silent.push_back(neighbour.region);
    return silent;
  }
  // Looks every interval, and says when it was given up.
  Duration GivenUpAfter(bool heard) {
    for (TimePoint now = kStart;; now += NeighbourWatch::kInterval) {
      if (heard) links.Heard(kSecond, now);
      if (!Look(now).empty()) return now - kStart;
    }
  }

  NeighbourWatch watch;
  LinkTable links{kSelf};
  Actions actions;
};

TEST_F(NeighbourWatchTest, LooksOnceInAnIntervalInWhichNothingWasStepped) {
  EXPECT_FALSE(watch.Due(kStart + NeighbourWatch::kInterval / 2, kStart));
  const TimePoint now = kStart + NeighbourWatch::kInterval;
  EXPECT_TRUE(watch.Due(now, kStart));
  Look(now);
  EXPECT_FALSE(watch.Due(now, kStart));
  EXPECT_TRUE(watch.Due(now + NeighbourWatch::kInterval, kStart));
}

TEST_F(NeighbourWatchTest, ASilentNeighbourIsGivenUp) { EXPECT_EQ(GivenUpAfter(false), NeighbourWatch::kSilence); }

TEST_F(NeighbourWatchTest, ANeighbourThatIsWellIsGivenUpOnceAllAreStuck) {
  EXPECT_EQ(GivenUpAfter(true), NeighbourWatch::kStuck);
}

TEST_F(NeighbourWatchTest, AStepBeginsTheCountAnew) {
  Look(kStart);
  watch.Stepped();
  TimePoint now = kStart;
  while ((now += NeighbourWatch::kInterval) <= kStart + NeighbourWatch::kSilence) EXPECT_THAT(Look(now), IsEmpty());
  EXPECT_THAT(Look(now), ElementsAre(kSecond));
}

TEST_F(NeighbourWatchTest, AfterALookThatCameLateNobodyIsGivenUp) {
  Look(kStart);
  EXPECT_THAT(Look(kStart + std::chrono::seconds(5)), IsEmpty());
}

TEST_F(NeighbourWatchTest, WhoIsNotWaitedForIsNotGivenUp) {
  for (TimePoint now = kStart; now < kStart + std::chrono::seconds(2); now += NeighbourWatch::kInterval) {
    EXPECT_THAT(Look(now, {}), IsEmpty());
  }
}

TEST_F(NeighbourWatchTest, WhereTicksAreLongANeighbourWhoseTurnComesLaterIsNotStuck) {
  for (TimePoint now = kStart; now <= kStart + std::chrono::milliseconds(2950); now += NeighbourWatch::kInterval) {
    links.Heard(kSecond, now);
    const std::vector<RegionId> waited_for{kSecond};
    EXPECT_THAT(watch.Look(waited_for, links, now, std::chrono::seconds(1)), IsEmpty());
  }
}

}  // namespace
}  // namespace tessera::worker
