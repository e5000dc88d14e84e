#include "core/region/handover.h"

#include <gtest/gtest.h>

namespace tessera::region {
namespace {

// Regions 1 and 2 in the first row, 3 and 4 in the second, over -10 .. 10.
class HandoverTest : public ::testing::Test {
 protected:
  std::optional<RegionId> From(std::uint32_t self, Vec3d place, double hysteresis_m = 0.25) const {
    return HandoverTarget(map, RegionId(self), map.Neighbors(RegionId(self)), place, hysteresis_m);
  }
  const PartitionMap map = *MakeGridMap({-10, -10, 10, 10}, 4);
};

TEST_F(HandoverTest, ABodyStaysUntilItIsBeyondTheHysteresis) {
  EXPECT_EQ(From(1, {-0.1, 0, -5}), std::nullopt);
  EXPECT_EQ(From(1, {0.2, 0, -5}), std::nullopt);
  EXPECT_EQ(From(1, {0.3, 0, -5}), RegionId(2));
  EXPECT_EQ(From(2, {0.3, 0, -5}), std::nullopt);
  EXPECT_EQ(From(2, {-0.2, 0, -5}), std::nullopt);
}

TEST_F(HandoverTest, ACornerLeadsToTheOneDiagonallyAcross) { EXPECT_EQ(From(1, {0.3, 0, 0.3}), RegionId(4)); }

TEST_F(HandoverTest, OutsideTheWorldTheNearestCellCountsWithTheSameHysteresis) {
  EXPECT_EQ(From(1, {-500, 0, -5}), std::nullopt);
  EXPECT_EQ(From(1, {0.2, 0, -500}), std::nullopt);
  EXPECT_EQ(From(1, {0.3, 0, -500}), RegionId(2));
  EXPECT_EQ(From(2, {-0.2, 0, -500}), std::nullopt);
}

TEST_F(HandoverTest, FarAwayItGoesToTheNeighbourOnTheWay) {
  const PartitionMap row = *PartitionMap::Create(
      MapVersion(1), {0, 0, 40, 10},
      {{{0, 0, 10, 10}, RegionId(1), Epoch(1)},
       {{10, 0, 20, 10}, RegionId(2), Epoch(1)},
       {{20, 0, 30, 10}, RegionId(3), Epoch(1)},
       {{30, 0, 40, 10}, RegionId(4), Epoch(1)}},
      {{RegionId(1), RegionId()}, {RegionId(2), RegionId()}, {RegionId(3), RegionId()}, {RegionId(4), RegionId()}});
  const auto from = [&](std::uint32_t self) {
    return HandoverTarget(row, RegionId(self), row.Neighbors(RegionId(self)), {35, 0, 5}, 0.25);
  };
  EXPECT_EQ(from(1), RegionId(2));
  EXPECT_EQ(from(2), RegionId(3));
  EXPECT_EQ(from(3), RegionId(4));
  EXPECT_EQ(from(4), std::nullopt);
}

}  // namespace
}  // namespace tessera::region
