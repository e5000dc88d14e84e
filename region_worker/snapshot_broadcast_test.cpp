#include "region_worker/snapshot_broadcast.h"

#include <gtest/gtest.h>

namespace tessera::worker {
namespace {

TEST(SnapshotFallsOnTest, AnyPairOfRatesKeepsItsMeanInEveryRegion) {
  for (const std::uint32_t rate : {1U, 7U, 20U, 30U, 59U, 60U}) {
    for (std::uint32_t region = 1; region <= 5; ++region) {
      std::uint32_t count = 0;
      for (std::uint64_t tick = 61; tick <= 660; ++tick) {
        count += SnapshotFallsOn(Tick(tick), RegionId(region), rate, 60) ? 1 : 0;
      }
      EXPECT_EQ(count, 10 * rate) << region;
    }
  }
}

TEST(SnapshotFallsOnTest, NeighboursTakeTurns) {
  for (std::uint64_t tick = 1; tick <= 120; ++tick) {
    EXPECT_NE(SnapshotFallsOn(Tick(tick), RegionId(1), 30, 60), SnapshotFallsOn(Tick(tick), RegionId(2), 30, 60));
    int of_three = 0;
    for (std::uint32_t region = 1; region <= 3; ++region) {
      of_three += SnapshotFallsOn(Tick(tick), RegionId(region), 20, 60) ? 1 : 0;
    }
    EXPECT_EQ(of_three, 1) << tick;
  }
}

TEST(SnapshotFallsOnTest, AWorldThatStandsAtItsBeginningIsShown) {
  for (std::uint32_t region = 1; region <= 4; ++region) {
    EXPECT_TRUE(SnapshotFallsOn(Tick(0), RegionId(region), 20, 60));
  }
}

}  // namespace
}  // namespace tessera::worker
