// The suite runs, and what it must hold on a trace too short to measure by.
#include "bench/snapshots.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace tessera::bench {
namespace {

double ValueOf(const Report& report, const std::string& config, const std::string& metric) {
  for (const Figure& figure : report.figures()) {
    if (figure.config == config && figure.metric == metric) return figure.value;
  }
  ADD_FAILURE() << "no " << metric << " of " << config;
  return 0;
}

TEST(SnapshotsSuiteTest, CodersBeatTheBitPackerAndRestCostsNothing) {
  Report report("snapshots");
  const absl::Status status = RunSnapshots({.quick = true, .only = "cubes901", .csv = {}}, report);
  ASSERT_TRUE(status.ok()) << status;
  std::printf("%s\n", report.Table().c_str());
  EXPECT_LT(ValueOf(report, "coder=fast", "bytes_ratio_to_bitpacker"), 0.85);
  EXPECT_LT(ValueOf(report, "coder=dense", "bytes_ratio_to_bitpacker"), 0.7);
  EXPECT_LT(ValueOf(report, "live", "rest_kbps"), 2);
}

TEST(SnapshotsSuiteTest, ManyClientsAreServed) {
  Report report("snapshots");
  const absl::Status status = RunSnapshots({.quick = true, .only = "scale", .csv = {}}, report);
  ASSERT_TRUE(status.ok()) << status;
  std::printf("%s\n", report.Table().c_str());
  EXPECT_GT(ValueOf(report, "100 clients", "records_a_snapshot"), 30);
  EXPECT_LT(ValueOf(report, "100 clients", "records_a_snapshot"), 300);
}

}  // namespace
}  // namespace tessera::bench
