#include "bench/scrape.h"

#include <gtest/gtest.h>

namespace tessera::bench {
namespace {

const char* const kBefore =
    "# HELP x A histogram\n# TYPE x histogram\n"
    "x_bucket{le=\"0.001\"} 0\nx_bucket{le=\"0.002\"} 0\nx_bucket{le=\"+Inf\"} 0\nx_sum 0\nx_count 0\n";
const char* const kAfter =
    "x_bucket{le=\"0.001\"} 50\nx_bucket{le=\"0.002\"} 100\nx_bucket{le=\"+Inf\"} 100\nx_sum 0.1\nx_count 100\n"
    "bodies{state=\"owned here\"} 7\n";

TEST(ScrapeTest, ReadsNamesWithLabelsAsTheyStand) {
  const Samples samples = ParseMetrics(kAfter);
  EXPECT_EQ(samples.at("bodies{state=\"owned here\"}"), 7);
  EXPECT_EQ(samples.at("x_count"), 100);
  EXPECT_EQ(samples.size(), 6u);
}

TEST(ScrapeTest, MeansAndQuantilesAreThoseOfTheTimeBetween) {
  const Samples before = ParseMetrics(kBefore), after = ParseMetrics(kAfter);
  EXPECT_DOUBLE_EQ(HistogramBetween(before, after, "x").mean(), 0.001);
  EXPECT_DOUBLE_EQ(QuantileBetween(before, after, "x", 0.5), 0.001);
  EXPECT_DOUBLE_EQ(QuantileBetween(before, after, "x", 0.75), 0.0015);
  EXPECT_DOUBLE_EQ(QuantileBetween(after, after, "x", 0.5), 0);
}

}  // namespace
}  // namespace tessera::bench
