#include "core/region/neighborhood.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera::region {
namespace {

using ::testing::ElementsAre;

// Regions 1 to 4 in a square; in the row of two, 1 and 2 halve the same ground.
const PartitionMap kSquare = *MakeGridMap({-10, -10, 10, 10}, 4);
const PartitionMap kRow = *MakeGridMap({-10, -10, 10, 10}, 2);

TEST(NeighborhoodTest, FindsNeighboursByTheirPlace) {
  const Neighborhood around(RegionId(2), kSquare);
  EXPECT_THAT(around.neighbors(), ElementsAre(RegionId(1), RegionId(3), RegionId(4)));
  EXPECT_EQ(around.IndexOf(RegionId(3)), 1);
  EXPECT_EQ(around.IndexOf(RegionId(2)), -1);
  EXPECT_EQ(around.IndexOf(RegionId(9)), -1);
}

TEST(NeighborhoodTest, OnlyThoseThatStayAreGrantedToOnceAMapIsAnnounced) {
  Neighborhood around(RegionId(1), kSquare);
  EXPECT_THAT(around.grantable(), ElementsAre(RegionId(2), RegionId(3), RegionId(4)));
  around.Announce(kRow);
  EXPECT_THAT(around.grantable(), ElementsAre(RegionId(2)));
  EXPECT_EQ(around.size(), 3U);  // frames are exchanged as before
  around.Adopt(kRow);
  EXPECT_THAT(around.neighbors(), ElementsAre(RegionId(2)));
  around.Validate();
}

}  // namespace
}  // namespace tessera::region
