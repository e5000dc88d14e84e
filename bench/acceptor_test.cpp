#include "bench/acceptor.h"

#include <gtest/gtest.h>

namespace tessera::bench {
namespace {

// Only what holds on any machine: no time.
TEST(BenchAcceptorTest, AQuickRunSaysThatNothingForgedWasTakenAndNothingAmplified) {
  Report report("snapshots");
  const absl::Status status = RunAcceptor({.quick = true, .only = "", .csv = ""}, report);
  ASSERT_TRUE(status.ok()) << status;
  int floods = 0, forgeries = 0, logins = 0;
  for (const Figure& figure : report.figures()) {
    if (figure.metric == "reply_amplification") {
      ++floods;
      EXPECT_LT(figure.value, 1) << figure.config;
    }
    if (figure.metric == "login_acceptor_us" || figure.metric == "login_dialler_us") ++logins;
    if (figure.metric == "forged_accepted") {
      ++forgeries;
      EXPECT_EQ(figure.value, 0) << figure.config;
    }
  }
  EXPECT_EQ(floods, 2);
  EXPECT_EQ(forgeries, 2);
  EXPECT_EQ(logins, 2);
}

}  // namespace
}  // namespace tessera::bench
