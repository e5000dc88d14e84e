#include "bench/front.h"

#include <gmock/gmock.h>

#include <limits>

namespace tessera::bench {
namespace {

constexpr double kWorst = 1;

std::vector<Offer> Front(std::vector<Offer> offers) { return FrontOf(std::move(offers), 1e-9, kWorst); }

TEST(FrontTest, KeepsWhatNothingBeats) {
  const std::vector<Offer> front = Front({{0.1, 5}, {0.01, 20}, {0.2, 6}, {0.05, 4}, {0.01, 30}});
  ASSERT_EQ(front.size(), 2u);
  EXPECT_EQ(front[0].cpu_us, 4);
  EXPECT_EQ(front[1].cpu_us, 20);
}

TEST(FrontTest, LeavesOutRunsThatFailed) {
  EXPECT_TRUE(Front({{std::numeric_limits<double>::quiet_NaN(), 1}, {2, 1}}).empty());
}

TEST(FrontTest, RoundingDecidesNothing) { EXPECT_EQ(Front({{1e-15, 9}, {1e-12, 3}}).size(), 1u); }

TEST(FrontTest, ANearlyEqualErrorIsWorthNothing) { EXPECT_EQ(Front({{0.1, 3}, {0.0999, 9}}).size(), 1u); }

TEST(FrontTest, AheadEverywhereDominates) {
  EXPECT_TRUE(Dominates(Front({{0.1, 1}, {0.001, 2}}), Front({{0.2, 3}, {0.01, 8}})));
}

TEST(FrontTest, BehindAtOneErrorDoesNot) {
  EXPECT_FALSE(Dominates(Front({{0.1, 1}, {0.001, 9}}), Front({{0.2, 3}, {0.001, 8}})));
  EXPECT_FALSE(Dominates(Front({{0.001, 4}}), Front({{0.2, 3}, {0.01, 8}})));  // too dear where little is asked
}

TEST(FrontTest, WhatOnlyOneReachesDoesNotCount) {
  EXPECT_TRUE(Dominates(Front({{0.1, 1}}), Front({{0.2, 3}, {0.001, 8}})));
}

TEST(FrontTest, WhoReachesNothingIsBehind) {
  EXPECT_TRUE(Dominates(Front({{0.1, 1}}), Front({})));
  EXPECT_FALSE(Dominates(Front({}), Front({{0.1, 1}})));
  EXPECT_FALSE(Dominates(Front({}), Front({})));
}

}  // namespace
}  // namespace tessera::bench
