#include "region_worker/core/world_clock.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "region_worker/testing/small_world.h"

namespace tessera::worker {
namespace {

// A map of one region, of this version and with these terms.
PartitionMap ClockMap(std::uint64_t version, WorldTerms terms) {
  const PartitionMap one = *MakeGridMap(SmallWorld()->ground(), 1);
  const auto made = PartitionMap::Create(MapVersion(version), one.bounds(), {one.cells().begin(), one.cells().end()},
                                         {one.regions().begin(), one.regions().end()});
  return made->With(terms);
}

TEST(WorldClockTest, APauseHoldsUntilItsMapIsResumed) {
  WorldClock clock(60);
  EXPECT_FALSE(clock.paused());
  EXPECT_TRUE(clock.Follow(ClockMap(5, {.paused = true}), nullptr));
  EXPECT_TRUE(clock.paused());
  clock.Resume(MapVersion(4));
  EXPECT_FALSE(clock.Follow(ClockMap(5, {.paused = true}), nullptr)) << "that was an earlier pause";
  EXPECT_TRUE(clock.paused());
  clock.Resume(MapVersion(5));
  EXPECT_TRUE(clock.Follow(ClockMap(5, {.paused = true}), nullptr));
  EXPECT_FALSE(clock.paused());
}

TEST(WorldClockTest, TheNextPauseIsNotOverWithTheLast) {
  WorldClock clock(60);
  clock.Resume(MapVersion(5));
  clock.Resume(MapVersion(3));
  EXPECT_FALSE(clock.Follow(ClockMap(5, {.paused = true}), nullptr)) << "an older order takes nothing back";
  EXPECT_TRUE(clock.Follow(ClockMap(6, {.paused = true}), nullptr));
  EXPECT_TRUE(clock.paused());
}

TEST(WorldClockTest, APauseThatIsOnlyCommittedDoesNotHoldYet) {
  WorldClock clock(60);
  const PartitionMap next = ClockMap(2, {.paused = true});
  EXPECT_FALSE(clock.Follow(ClockMap(1, {}), &next));
  EXPECT_FALSE(clock.paused());
}

TEST(WorldClockTest, TheFasterOfTwoPacesCounts) {
  WorldClock clock(60);
  const PartitionMap slow = ClockMap(1, {.ticks_per_second = 2}), fast = ClockMap(2, {.ticks_per_second = 30});
  EXPECT_TRUE(clock.Follow(slow, nullptr));
  EXPECT_EQ(clock.state().ticks_per_second, 2);
  EXPECT_TRUE(clock.Follow(slow, &fast));
  EXPECT_EQ(clock.state().ticks_per_second, 30) << "as soon as it is committed";
  EXPECT_FALSE(clock.Follow(fast, &slow));
  EXPECT_EQ(clock.state().ticks_per_second, 30) << "until the slower one is in force";
}

TEST(WorldClockTest, NoPaceIsAboveTheTickRate) {
  WorldClock clock(60);
  EXPECT_EQ(clock.state().ticks_per_second, 60);
  EXPECT_FALSE(clock.Follow(ClockMap(1, {.ticks_per_second = 100}), nullptr));
  EXPECT_FALSE(clock.Follow(ClockMap(2, {}), nullptr)) << "without a pace it is the tick rate";
  EXPECT_EQ(clock.state().ticks_per_second, 60);
}

}  // namespace
}  // namespace tessera::worker
