#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "bench/lean.h"
#include "bench/speed.h"
#include "bench/statistics.h"
#include "bench/work_counter.h"

namespace tessera::bench {
namespace {

TEST(StatisticsTest, QuantilesLieBetweenNeighbours) {
  EXPECT_EQ(Median({3, 1, 2}), 2);
  EXPECT_EQ(Median({4, 1, 2, 3}), 2.5);
  EXPECT_EQ(Quantile({10, 20, 30, 40, 50}, 0), 10);
  EXPECT_EQ(Quantile({10, 20, 30, 40, 50}, 1), 50);
  EXPECT_NEAR(Quantile({10, 20, 30, 40, 50}, 0.9), 46, 1e-12);
  EXPECT_TRUE(std::isnan(Median({})));
}

TEST(WorkCounterTest, TenTimesTheWorkCountsForMore) {
  const WorkCounter counter;
  volatile double sink = 1;
  const auto work = [&](int n) {
    return counter.Of([&] {
      for (int i = 0; i < n; ++i) sink = sink * 1.0000001;
    });
  };
  EXPECT_GT(work(10'000'000), work(1'000'000));
}

std::set<std::string> MetricsOf(const Report& report, const std::string& engine) {
  std::set<std::string> metrics;
  for (const Figure& figure : report.figures()) {
    EXPECT_TRUE(std::isfinite(figure.value)) << figure.metric;
    if (figure.engine == engine) metrics.insert(figure.metric);
  }
  return metrics;
}

TEST(SpeedTest, TellsTimeAndWhatTheRunCameToForBoth) {
  Report report("speed");
  const absl::Status status = RunSpeed({.quick = true, .only = "many_pyramids", .csv = {}}, report);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_THAT(MetricsOf(report, "tessera"),
              testing::IsSupersetOf({"time_ratio", "time_ratio_p10", "time_ratio_p90", "time_ratio_total", "counts",
                                     "step_ms", "penetration_mean_m", "penetration_deepest_m", "drift_m"}));
  EXPECT_THAT(MetricsOf(report, "bullet"), testing::IsSupersetOf({"step_ms", "penetration_mean_m", "drift_m"}));
  for (const Figure& figure : report.figures()) {
    if (figure.metric == "fallen_through") {
      EXPECT_EQ(figure.value, 0) << figure.engine;
    } else if (figure.metric == "drift_m") {
      EXPECT_LT(figure.value, 0.5) << figure.engine;  // they stand, in either
    }
  }
}

TEST(LeanTest, BodiesThatRestAreNotSentAgain) {
  Report report("lean");
  ASSERT_TRUE(RunLean({.quick = true, .only = "unchanged_bodies_sent", .csv = {}}, report).ok());
  ASSERT_FALSE(report.figures().empty());
  EXPECT_EQ(report.figures()[0].metric, "lean_cost_ratio");
  EXPECT_LE(report.figures()[0].value, 1.01);  // bytes, so the same on every machine
}

TEST(LeanTest, EveryPairCanBeMadeAndStepped) {
  std::set<std::string> names;
  for (const auto& lines : {PhysicsLines(), RegionLines()}) {
    for (const LeanLine& line : lines) {
      EXPECT_TRUE(names.insert(line.name).second) << line.name;
      LeanPair pair = line.make();
      EXPECT_GT(pair.without(), 0) << line.name;
      EXPECT_GT(pair.with(), 0) << line.name;
    }
  }
}

}  // namespace
}  // namespace tessera::bench
