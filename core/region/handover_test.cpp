#include "core/region/handover.h"

#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

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

// Region 1 has x < 0; all but body 5 are beyond it.
class PlanHandoversTest : public ::testing::Test {
 protected:
  PlanHandoversTest() {
    Scene scene = Balls({{1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {-5, 0, 0}});
    Join(scene, 2, 5);
    world.emplace(std::move(scene));
    for (const std::uint64_t id : {1, 2, 3, 4, 5}) world->Own(id);
  }
  std::vector<std::vector<std::size_t>> Plan() const {
    std::vector<std::vector<std::size_t>> assemblies;
    for (const PlannedHandover& planned :
         PlanHandovers(world->bodies, world->neighborhood, settings, [this](RegionId) { return may_grant; })) {
      assemblies.push_back(planned.assembly);
    }
    return assemblies;
  }
  std::optional<SmallWorld> world;
  RegionSettings settings;
  bool may_grant = true;
};

TEST_F(PlanHandoversTest, AnAssemblyGoesWithItsLowestBodyAndWhole) {
  using Plans = std::vector<std::vector<std::size_t>>;
  EXPECT_EQ(Plan(), (Plans{{0}, {1, 4}, {2}, {3}}));
  settings.max_grants_per_tick = 2;
  EXPECT_EQ(Plan(), (Plans{{0}, {1, 4}}));
}

TEST_F(PlanHandoversTest, NothingGoesWhereNoFrameGoes) {
  may_grant = false;
  EXPECT_TRUE(Plan().empty());
}

TEST_F(PlanHandoversTest, AMapIsSettledOnceNothingLiesFarFromHome) {
  const auto away = [&](const KeptGrants& kept = {}) {
    return CountAway(world->bodies, kept, world->catalog, world->neighborhood, settings, SmallWorld::kTick_s);
  };
  EXPECT_EQ(away(), 4U);  // bodies 1 to 4; 5 counts with 2
  for (const std::uint64_t id : {1, 2, 3, 4}) world->bodies.RemoveOwned(BodyId(id));
  EXPECT_EQ(away(), 0U);
  KeptGrants kept;
  kept[{BodyId(3), Epoch(2)}].state = world->InitialOf(3);
  EXPECT_EQ(away(kept), 1U);
  BodyState crossing = world->InitialOf(3);
  crossing.position.x = 0.5;
  crossing.linear_velocity = {30, 0, 0};
  kept[{BodyId(3), Epoch(2)}].state = crossing;
  EXPECT_EQ(away(kept), 0U);
}

}  // namespace
}  // namespace tessera::region
