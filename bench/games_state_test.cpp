#include "bench/games_state.h"

#include <gtest/gtest.h>

namespace tessera::bench {
namespace {

TEST(GamesStateTest, NoDeathTakesBackWhatAClientWasToldOf) {
  const StateFigures figures = PlayThroughDeaths(20);
  EXPECT_EQ(figures.deaths, 20U);
  EXPECT_EQ(figures.properties_lost, 0U);
  EXPECT_EQ(figures.spawns_lost, 0U);
  EXPECT_EQ(figures.removals_lost, 0U);
  EXPECT_EQ(figures.events_lost, 0U);
  EXPECT_GT(figures.told_spawns, 400U);
  EXPECT_GT(figures.told_removals, 300U);
  EXPECT_GT(figures.told_events, 150U);
}

}  // namespace
}  // namespace tessera::bench
