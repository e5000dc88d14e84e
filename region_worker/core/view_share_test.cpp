#include "region_worker/core/view_share.h"

#include <gtest/gtest.h>

namespace tessera::worker {
namespace {

constexpr Rect kWorld{-100, -100, 100, 100};
constexpr double kRadius_m = 40;

double Sum(const PartitionMap& map, Vec3d centre) {
  double sum = 0;
  for (const MapRegion& region : map.regions()) sum += ViewShare(map, region.id, centre, kRadius_m);
  return sum;
}

TEST(ViewShareTest, OneRegionHasAllOfIt) {
  EXPECT_EQ(ViewShare(*MakeGridMap(kWorld, 1), RegionId(1), {50, 0, 50}, kRadius_m), 1);
}

TEST(ViewShareTest, SharesComeToOneWhereverTheClientIs) {
  for (const std::uint32_t regions : {2U, 4U, 9U}) {
    const PartitionMap map = *MakeGridMap(kWorld, regions);
    for (double x = -150; x <= 150; x += 10) {
      for (double z = -150; z <= 150; z += 30) EXPECT_NEAR(Sum(map, {x, 0, z}), 1, 1e-9) << x << ", " << z;
    }
  }
}

TEST(ViewShareTest, WhoHoldsAllThatIsSeenHasAlmostAll) {
  const PartitionMap map = *MakeGridMap(kWorld, 4);
  const Vec3d inside{50, 0, 50};
  const RegionId holder = map.OwnerOf(inside);
  for (const MapRegion& region : map.regions()) {
    EXPECT_NEAR(ViewShare(map, region.id, inside, kRadius_m), region.id == holder ? 0.9 : 0.1 / 3, 1e-9);
  }
}

TEST(ViewShareTest, OthersHaveAsMuchAsTheyHaveOfTheView) {
  const PartitionMap map = *MakeGridMap(kWorld, 2);
  // A quarter of the view lies beyond the border at x = 0.
  EXPECT_NEAR(ViewShare(map, map.OwnerOf({20, 0, 0}), {20, 0, 0}, kRadius_m), 0.9 * 0.75, 1e-9);
  EXPECT_NEAR(ViewShare(map, map.OwnerOf({-20, 0, 0}), {20, 0, 0}, kRadius_m), 0.9 * 0.25 + 0.1, 1e-9);
}

TEST(ViewShareTest, WhoHoldsThePlaceHasHalfAtLeast) {
  const PartitionMap map = *MakeGridMap(kWorld, 4);
  EXPECT_NEAR(ViewShare(map, map.OwnerOf({1, 0, 1}), {1, 0, 1}, kRadius_m), 0.5, 1e-9);
}

}  // namespace
}  // namespace tessera::worker
