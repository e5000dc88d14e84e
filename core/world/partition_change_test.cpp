#include "core/world/partition_change.h"

#include <gmock/gmock.h>

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr Rect kEightByEight{0, 0, 8, 8};

PartitionMap SquareGrid(std::uint32_t n) { return *MakeGridMap(kEightByEight, n); }

// The places of a fine raster that `region` owns.
std::size_t Places(const PartitionMap& map, RegionId region) {
  std::size_t places = 0;
  for (double x = 0.25; x < 8; x += 0.5) {
    for (double z = 0.25; z < 8; z += 0.5) places += map.OwnerOf({x, 0, z}) == region ? 1 : 0;
  }
  return places;
}

TEST(TransitionMapTest, HasTheNewOwnersAndNamesTheOldOnesWhereTheyDiffer) {
  const PartitionMap two = SquareGrid(2), four = SquareGrid(4);
  const PartitionMap map = *TransitionMap(two, four, MapVersion(2));
  for (double x = 0.25; x < 8; x += 0.5) {
    for (double z = 0.25; z < 8; z += 0.5) {
      const Cell& cell = map.CellAt(x, z);
      const Cell &before = two.CellAt(x, z), &after = four.CellAt(x, z);
      EXPECT_EQ(cell.owner, after.owner);
      EXPECT_EQ(cell.from, before.owner == after.owner ? RegionId() : before.owner);
      EXPECT_EQ(cell.epoch.value(), before.owner == after.owner ? 1U : 2U);
    }
  }
  EXPECT_TRUE(InTransition(map));
  EXPECT_EQ(map.regions().size(), 4U);
}

TEST(TransitionMapTest, OldOwnersStayNeighboursOfAllWhomTheirBodiesCouldTouch) {
  // Region 1 has the west half and gives its upper quarter to 3, which meets 2 in the middle.
  const PartitionMap map = *TransitionMap(SquareGrid(2), SquareGrid(4), MapVersion(2));
  EXPECT_THAT(map.Neighbors(RegionId(1)), ElementsAre(RegionId(2), RegionId(3), RegionId(4)));
  EXPECT_THAT(map.Neighbors(RegionId(3)), ElementsAre(RegionId(1), RegionId(2), RegionId(4)));
  for (const MapRegion& region : map.regions()) {
    for (const RegionId other : map.Neighbors(region.id)) {
      EXPECT_THAT(map.Neighbors(other), ::testing::Contains(region.id));
    }
  }
}

TEST(TransitionMapTest, ReachesCellsThatBodiesMayStillBeIn) {
  const PartitionMap map = *TransitionMap(SquareGrid(1), SquareGrid(2), MapVersion(2));
  const Aabb east{{6, 0, 4}, {7, 1, 5}};
  EXPECT_TRUE(map.Reaches(RegionId(1), east));
  EXPECT_TRUE(map.Reaches(RegionId(2), east));
  EXPECT_FALSE(SettledMap(map, MapVersion(3))->Reaches(RegionId(1), east));
  EXPECT_GT(map.DistanceTo(RegionId(1), {6, 0, 4}), 1);  // it hands over the bodies there
}

TEST(SettledMapTest, LeadsToWhatWasWanted) {
  PartitionMap map = SquareGrid(2);
  std::uint64_t version = 1;
  for (const std::uint32_t n : {4U, 2U, 5U, 1U, 3U}) {
    map = *TransitionMap(map, SquareGrid(n), MapVersion(++version));
    EXPECT_EQ(map.version(), MapVersion(version));
    map = *SettledMap(map, MapVersion(++version));
    EXPECT_FALSE(InTransition(map));
    EXPECT_EQ(map.regions().size(), n);
    EXPECT_EQ(map.cells().size(), n) << "pieces are made whole again";
    for (std::uint32_t id = 1; id <= n; ++id) EXPECT_EQ(Places(map, RegionId(id)), Places(SquareGrid(n), RegionId(id)));
  }
}

TEST(FailoverMapTest, GivesTheCellsOfTheDeadToTheirStandbys) {
  const PartitionMap map = *FailoverMap(SquareGrid(4), std::vector{RegionId(2)}, MapVersion(7));
  EXPECT_EQ(map.version(), MapVersion(7));
  EXPECT_EQ(map.regions().size(), 3U);
  EXPECT_EQ(Places(map, RegionId(3)), 128U);
  EXPECT_EQ(map.CellAt(6, 1).epoch, Epoch(2));
  EXPECT_EQ(map.CellAt(1, 1).epoch, Epoch(1));
  EXPECT_EQ(map.regions()[0].standby, RegionId()) << "region 1's standby died";
}

TEST(FailoverMapTest, FollowsTheStandbyOfADeadStandby) {
  const PartitionMap map = *FailoverMap(SquareGrid(4), std::vector{RegionId(3), RegionId(2)}, MapVersion(2));
  EXPECT_EQ(Places(map, RegionId(4)), 192U);
  const PartitionMap one = *FailoverMap(SquareGrid(2), std::vector{RegionId(2)}, MapVersion(2));
  EXPECT_EQ(one.cells().size(), 1U);
  EXPECT_EQ(one.cells()[0].owner, RegionId(1));
}

TEST(FailoverMapTest, RefusesWhatLeavesNobody) {
  EXPECT_THAT(FailoverMap(SquareGrid(1), std::vector{RegionId(1)}, MapVersion(2)).status().message(),
              HasSubstr("no region would be left"));
  EXPECT_THAT(FailoverMap(SquareGrid(2), std::vector{RegionId(9)}, MapVersion(2)).status().message(),
              HasSubstr("no region 9"));
  EXPECT_THAT(FailoverMap(SquareGrid(2), std::vector{RegionId(1)}, MapVersion(1)).status().message(),
              HasSubstr("version"));
}

TEST(PartitionMapTest, RefusesACellThatComesFromItsOwnerOrFromNobodyKnown) {
  const auto make = [](RegionId from) {
    return PartitionMap::Create(MapVersion(1), kEightByEight, {{kEightByEight, RegionId(1), Epoch(1), from}},
                                {{RegionId(1), RegionId()}})
        .status();
  };
  EXPECT_THAT(make(RegionId(1)).message(), HasSubstr("cells[0].from: region 1 owns it"));
  EXPECT_THAT(make(RegionId(2)).message(), HasSubstr("cells[0].from: there is no region 2"));
}

}  // namespace
}  // namespace tessera
