#include "client_sdk/stats.h"

#include <gtest/gtest.h>

namespace tessera::client {
namespace {

using std::chrono::microseconds;

TEST(DurationStatsTest, QuantilesErrByAFewPercent) {
  DurationStats stats;
  for (int i = 1; i <= 1000; ++i) stats.Add(microseconds(10 * i));
  const DurationSummary summary = stats.Summary();
  EXPECT_EQ(summary.count, 1000u);
  EXPECT_NEAR(summary.mean_s, 5.005e-3, 1e-9);
  EXPECT_NEAR(summary.p50_s, 5e-3, 0.06 * 5e-3);
  EXPECT_NEAR(summary.p99_s, 9.9e-3, 0.06 * 9.9e-3);
  EXPECT_NEAR(summary.max_s, 10e-3, 1e-12);
}

TEST(DurationStatsTest, TakesAnyDuration) {
  DurationStats stats;
  EXPECT_EQ(stats.Summary().count, 0u);
  stats.Add(std::chrono::nanoseconds(-5));
  stats.Add(std::chrono::nanoseconds(0));
  stats.Add(std::chrono::hours(100));
  EXPECT_EQ(stats.Summary().count, 3u);
}

}  // namespace
}  // namespace tessera::client
