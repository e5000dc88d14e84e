// The suite runs, and what does not depend on this machine's speed is within its goals.
#include "bench/sdk.h"

#include <gtest/gtest.h>

namespace tessera::bench {
namespace {

double Measured(const Report& report, const std::string& metric) {
  for (const Figure& figure : report.figures()) {
    if (figure.metric == metric) return figure.value;
  }
  ADD_FAILURE() << "no " << metric;
  return 0;
}

TEST(SdkSuiteTest, AClientThatStoodIsAtTheNewestStateWithinTenPolls) {
  Report report("sdk");
  MeasureLatePolls(true, report);
  EXPECT_GE(Measured(report, "catch_up_polls"), 1);
  EXPECT_LE(Measured(report, "catch_up_polls"), 10);
  EXPECT_GT(Measured(report, "datagrams_passed_over"), 0);
  EXPECT_GT(Measured(report, "late_poll_ratio"), 0);
}

TEST(SdkSuiteTest, ALargeMeshIsPredictedOnWithinASecond) {
  Report report("sdk");
  MeasureFirstPolls(true, report);
  EXPECT_LE(Measured(report, "predicting_after_s"), 1);
  EXPECT_GT(Measured(report, "first_polls_ratio"), 0);
}

TEST(SdkSuiteTest, WhatIsThrownBecomesTheServersWithoutAJump) {
  Report report("sdk");
  MeasureThrows(true, report);
  EXPECT_LT(Measured(report, "spawn_jump_m"), 0.02);
  EXPECT_GE(Measured(report, "spawn_jump_m"), 0);
  EXPECT_EQ(Measured(report, "spawns_not_taken"), 0);
  EXPECT_EQ(Measured(report, "spawn_frames_missing"), 0);
  EXPECT_EQ(Measured(report, "spawn_frames_doubled"), 0);
}

}  // namespace
}  // namespace tessera::bench
