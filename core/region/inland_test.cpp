#include "core/region/inland.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/region/cell_finder.h"
#include "core/region/relevance.h"
#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

TEST(CellFinderTest, GivesTheCellThatTheMapGives) {
  const PartitionMap map = *MakeGridMap({-10, -10, 10, 10}, 7);
  CellFinder cells(map);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(-14, 14);  // beyond the world, too
  std::uniform_int_distribution<int> edge(-4, 4);
  for (int i = 0; i < 2000; ++i) {
    const bool on_edge = i % 3 == 0;
    const Vec3d place{on_edge ? edge(random) * 2.5 : anywhere(random), 0,
                      on_edge ? edge(random) * 2.5 : anywhere(random)};
    EXPECT_EQ(&cells.At(place), &map.CellAt(place.x, place.z)) << place.x << ' ' << place.z;
  }
}

// Region 1 has the cells of x < 0 and one neighbour. Balls of half a metre without gravity.
class InlandTest : public ::testing::Test {
 protected:
  static constexpr double kGravity_m_s2 = 20;

  bool Inland(Vec3d gravity_m_s2 = {}) const {
    return AllInland(world->bodies, world->neighborhood, settings, gravity_m_s2, SmallWorld::kTick_s);
  }
  bool InlandWith(double x, Vec3f velocity = {}, Vec3d gravity_m_s2 = {}) {
    world.emplace(Balls({{-5, 0, 0}, {0, 0, 0}}));
    world->Own(1);
    BodyState state = world->InitialOf(2);
    state.position.x = x;
    state.linear_velocity = velocity;
    world->Own(2, state);
    return Inland(gravity_m_s2);
  }
  double Reach() const { return world->bodies.radius_m(1) + settings.aura_m; }

  std::optional<SmallWorld> world;
  const RegionSettings settings{.aura_m = 0.5, .lookahead_ticks = 4, .promise_ticks = 8};
  const double horizon_s = 12 * SmallWorld::kTick_s;
};

TEST_F(InlandTest, TheOutermostBodyDecides) {
  EXPECT_TRUE(InlandWith(-5));
  const double reach = Reach();
  EXPECT_TRUE(InlandWith(-reach - 0.01));
  EXPECT_FALSE(InlandWith(-reach + 0.01));
  EXPECT_FALSE(InlandWith(1));                // in a cell of the neighbour's
  EXPECT_FALSE(InlandWith(-10 + reach / 2));  // at the world's edge, which is not looked at more closely
}

TEST_F(InlandTest, SpeedAndGravityCountUntilANeighbourCouldHear) {
  EXPECT_TRUE(InlandWith(-5));
  const double reach = Reach(), gone_m = 10 * horizon_s, fallen_m = 0.5 * kGravity_m_s2 * horizon_s * horizon_s;
  EXPECT_TRUE(InlandWith(-reach - gone_m - 0.01, {0, 0, 10}));
  EXPECT_FALSE(InlandWith(-reach - gone_m + 0.01, {0, 0, 10}));
  EXPECT_TRUE(InlandWith(-reach - fallen_m - 0.01, {}, {0, -kGravity_m_s2, 0}));
  EXPECT_FALSE(InlandWith(-reach - fallen_m + 0.01, {}, {0, -kGravity_m_s2, 0}));
}

TEST_F(InlandTest, NobodyIsInland) {
  world.emplace(Balls({{-5, 0, 0}}));
  EXPECT_TRUE(Inland());
}

// Passing over the swept bounds of inland bodies loses no mark.
TEST_F(InlandTest, WhatIsInlandIsRelevantToNobody) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-9.5, -0.5);
  std::uniform_real_distribution<float> speed(-15, 15);
  int inland = 0;
  for (int i = 0; i < 300; ++i) {
    const bool is = InlandWith(place(random), {speed(random), speed(random), speed(random)});
    inland += is ? 1 : 0;
    if (!is) continue;
    world->Step();
    const std::vector<physics::Forces> forces(world->bodies.owned().size());
    const std::vector<std::span<const GhostRecord>> sent(1);
    Relevance relevance(world->catalog, settings, SmallWorld::kTick_s);
    relevance.Update({world->bodies, world->neighborhood, forces, {}, sent});
    EXPECT_FALSE(relevance.table().Any());
  }
  EXPECT_GT(inland, 20);
  EXPECT_LT(inland, 280);
}

}  // namespace
}  // namespace tessera::region
