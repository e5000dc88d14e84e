#include "bench/death_watch.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;

constexpr DeathWatch::TimePoint kStart{1s};

TEST(DeathWatchTest, CountsABodyOnceAnotherRegionMovesIt) {
  DeathWatch watch;
  watch.Begin({2});
  watch.Look(7, 2, {0, 0, 0}, kStart);
  watch.Look(8, 1, {0, 0, 0}, kStart);          // lives
  watch.Look(7, 2, {1, 0, 0}, kStart + 10ms);   // the dead region's last state
  watch.Look(7, 3, {1, 0, 0}, kStart + 100ms);  // has a new owner, and stands still
  watch.Look(8, 1, {5, 0, 0}, kStart + 100ms);
  EXPECT_TRUE(watch.moved_again().empty());
  EXPECT_FALSE(watch.most_moved_again());
  watch.Look(7, 3, {2, 0, 0}, kStart + 120ms);
  watch.Look(7, 3, {3, 0, 0}, kStart + 140ms);
  ASSERT_EQ(watch.moved_again().size(), 1u);
  EXPECT_EQ(watch.moved_again().at(7), kStart + 120ms);
  EXPECT_TRUE(watch.most_moved_again());
}

TEST(DeathWatchTest, DelayIsTheMedianOfBodiesThatBothSaw) {
  DeathWatch first, second;
  for (DeathWatch* watch : {&first, &second}) {
    watch->Begin({1});
    for (std::uint64_t body = 1; body <= 4; ++body) watch->Look(body, 1, {0, 0, 0}, kStart);
  }
  EXPECT_TRUE(std::isnan(MedianDelaySeconds(first, second)));
  for (std::uint64_t body = 1; body <= 3; ++body) first.Look(body, 2, {1, 0, 0}, kStart + 100ms);
  second.Look(1, 2, {1, 0, 0}, kStart + 110ms);
  second.Look(2, 2, {1, 0, 0}, kStart + 130ms);
  second.Look(3, 2, {1, 0, 0}, kStart + 400ms);
  second.Look(4, 2, {1, 0, 0}, kStart + 900ms);  // the first has not seen it
  EXPECT_NEAR(MedianDelaySeconds(first, second), 0.03, 1e-9);
}

}  // namespace
}  // namespace tessera::bench
