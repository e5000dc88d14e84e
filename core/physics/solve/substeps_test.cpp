#include "core/physics/solve/substeps.h"

#include <gtest/gtest.h>

#include <array>

namespace tessera::physics {
namespace {

// Substeps at which an island settles that has the same demand in each step.
int Settled(IslandDemand demand, int from) {
  demand.last = from;
  for (int i = 0; i < 10; ++i) demand.last = SubstepsFor(demand);
  return demand.last;
}

TEST(SubstepsTest, GrowWithTheLoad) {
  EXPECT_EQ(Settled({.load_ratio = 1}, 4), 2);
  EXPECT_EQ(Settled({.load_ratio = 9}, 4), 2);
  EXPECT_EQ(Settled({.load_ratio = 20}, 1), 4);
  EXPECT_EQ(Settled({.load_ratio = 40}, 1), 16);
  EXPECT_EQ(Settled({.load_ratio = 80}, 1), 32);
  EXPECT_EQ(Settled({.load_ratio = 1000}, 1), kMaxSubsteps);
}

TEST(SubstepsTest, FollowAChainsMassRatio) {
  EXPECT_EQ(SubstepsFor({.mass_ratio = 1000, .joints = 32}), 16);
  EXPECT_LE(SubstepsFor({.mass_ratio = 1000, .contacts = 1}), 8) << "a heavy ball that hits a light one";
}

TEST(SubstepsTest, ChangeByOnePowerAStep) {
  EXPECT_EQ(SubstepsFor({.last = 4, .load_ratio = 1000}), 8);
  EXPECT_EQ(SubstepsFor({.last = 64, .load_ratio = 1}), 32);
}

TEST(SubstepsTest, DoNotFlipWhereALoadHoversAtALimit) {
  EXPECT_EQ(Settled({.load_ratio = 21}, 4), 8);
  EXPECT_EQ(Settled({.load_ratio = 19}, 8), 8);
  EXPECT_EQ(Settled({.load_ratio = 14}, 8), 4);
}

TEST(SubstepsTest, TakeFromTheGreediestFirst) {
  std::array<IslandWork, 3> islands{IslandWork{1000, 0, 32}, {10, 0, 64}, {1000, 0, 2}};
  KeepBudget(islands, 12000);
  EXPECT_EQ(islands[0].substeps, 8);
  EXPECT_EQ(islands[1].substeps, 64);
  EXPECT_EQ(islands[2].substeps, 2);
  KeepBudget(islands, 0);
  for (const IslandWork& island : islands) EXPECT_EQ(island.substeps, 2) << "never fewer than hold a pile";
}

}  // namespace
}  // namespace tessera::physics
