#include "core/region/routes.h"

#include <gmock/gmock.h>

#include "core/region/testing/row_map.h"

namespace tessera::region {
namespace {

bool Everyone(RegionId) { return true; }

TEST(RoutesTest, DistancesCountBorders) {
  Routes routes;
  routes.Adopt(RowMap(4));
  EXPECT_EQ(routes.Distance(RegionId(1), RegionId(1)), 0U);
  EXPECT_EQ(routes.Distance(RegionId(1), RegionId(4)), 3U);
  EXPECT_EQ(routes.Distance(RegionId(1), RegionId(9)), std::nullopt);
  EXPECT_EQ(routes.NextHop(RegionId(1), RegionId(4), Everyone), RegionId(2));
  EXPECT_EQ(routes.NextHop(RegionId(3), RegionId(1), Everyone), RegionId(2));
  EXPECT_EQ(routes.NextHop(RegionId(3), RegionId(9), Everyone), RegionId());
}

TEST(RoutesTest, GoesAroundALinkThatIsDown) {
  Routes routes;
  routes.Adopt(*MakeGridMap({-10, -10, 10, 10}, 4));
  const auto without_two = [](RegionId region) { return region != RegionId(2); };
  EXPECT_EQ(routes.NextHop(RegionId(1), RegionId(2), without_two), RegionId(3));
  EXPECT_EQ(routes.NextHop(RegionId(1), RegionId(2), [](RegionId) { return false; }), RegionId());
}

}  // namespace
}  // namespace tessera::region
