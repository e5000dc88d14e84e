#include "core/region/whole_islands.h"

#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

// A row of balls that touch each other, away from the border; the first is relevant to region 2.
class WholeIslandsTest : public ::testing::Test {
 protected:
  WholeIslandsTest() {
    table.Reset(4, 1);
    table.Mark(0, 0);
  }
  void Mark(std::uint32_t most) {
    world.Step();
    islands.emplace(world.catalog, most);
    islands->Mark(world.bodies, world.neighborhood, table);
    islands->Validate(world.bodies);
  }
  void OwnAll() {
    for (const std::uint64_t id : {1, 2, 3, 4}) world.Own(id);
  }

  SmallWorld world{Balls({{-4, 0, 0}, {-5, 0, 0}, {-6, 0, 0}, {-9, 0, 0}})};
  RelevanceTable table;
  std::optional<WholeIslands> islands;
};

TEST_F(WholeIslandsTest, AllOfASmallIslandIsRelevantIfOneBodyIs) {
  OwnAll();
  Mark(3);
  EXPECT_TRUE(table.To(1, 0) && table.To(2, 0));
  EXPECT_FALSE(table.To(3, 0));  // no part of it
  EXPECT_TRUE(islands->IsWhole(0) && islands->IsWhole(2));
  EXPECT_FALSE(islands->IsWhole(3));
}

TEST_F(WholeIslandsTest, AnIslandThatIsTooLargeStaysAsItIs) {
  OwnAll();
  Mark(2);
  EXPECT_FALSE(table.To(1, 0) || islands->IsWhole(0));
}

TEST_F(WholeIslandsTest, ALargeIslandIsWholeIfAllOfItIsRelevantAnyway) {
  OwnAll();
  for (const std::size_t body : {1, 2}) table.Mark(body, 0);
  Mark(2);
  EXPECT_TRUE(islands->IsWhole(0) && islands->IsWhole(2));
}

TEST_F(WholeIslandsTest, BelowTwoNoIslandIsWhole) {
  OwnAll();
  Mark(1);
  EXPECT_FALSE(table.To(1, 0) || islands->IsWhole(0));
}

TEST_F(WholeIslandsTest, BodiesOfOthersConnectAndDoNotCount) {
  world.Own(1);
  world.Own(3);
  world.Own(4);
  world.AddGhost(2, 2);
  table.Reset(3, 1);
  table.Mark(0, 0);
  Mark(2);
  EXPECT_TRUE(table.To(1, 0));
  EXPECT_TRUE(islands->IsWhole(0) && islands->IsWhole(1));
}

TEST_F(WholeIslandsTest, ABodyThatCameAfterwardsIsNoticed) {
  for (const std::uint64_t id : {1, 2, 3}) world.Own(id);
  table.Reset(3, 1);
  Mark(3);
  world.Own(4);
  EXPECT_DEBUG_DEATH(islands->Validate(world.bodies), "");
}

TEST(MarkAroundTest, ABodyIsMarkedForNeighboursThatItsBoundsComeNear) {
  const Neighborhood around(RegionId(1), *MakeGridMap({-10, -10, 10, 10}, 4));
  RelevanceTable table;
  table.Reset(1, 3);
  MarkAround(0, {{-6, 0, -0.5}, {-5, 1, -0.2}}, around, table);
  EXPECT_FALSE(table.To(0, 0));  // region 2, to the east
  EXPECT_TRUE(table.To(0, 1));   // region 3, to the north
}

}  // namespace
}  // namespace tessera::region
