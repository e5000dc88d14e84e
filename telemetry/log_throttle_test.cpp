#include "telemetry/log_throttle.h"

#include <gtest/gtest.h>

namespace tessera::telemetry {
namespace {

using std::chrono::milliseconds;

TEST(LogThrottleTest, TenPassInASecondAndTheOthersAreCounted) {
  LogThrottle throttle;
  const LogThrottle::Clock::time_point begin{std::chrono::hours(1)};
  int passed = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto left_out = throttle.Take(begin + milliseconds(i));
    passed += left_out ? 1 : 0;
    EXPECT_EQ(left_out.value_or(0), 0U) << i;
  }
  EXPECT_EQ(passed, LogThrottle::kLinesPerSecond);
  EXPECT_EQ(throttle.Take(begin + milliseconds(1000)), 1000U - LogThrottle::kLinesPerSecond);
  EXPECT_EQ(throttle.Take(begin + milliseconds(1001)), 0U) << "each is counted once";
}

TEST(LogThrottleTest, WhatIsRareIsNeverLeftOut) {
  LogThrottle throttle;
  LogThrottle::Clock::time_point now{std::chrono::hours(1)};
  for (int i = 0; i < 100; ++i, now += milliseconds(100)) EXPECT_EQ(throttle.Take(now), 0U) << i;
}

TEST(LogThrottleTest, WhateverTheFloodNoMoreThanTenPassInASecond) {
  LogThrottle throttle;
  const LogThrottle::Clock::time_point begin{std::chrono::hours(1)};
  std::uint64_t passed = 0, left_out = 0;
  for (int i = 0; i < 100'000; ++i) {
    if (const auto more = throttle.Take(begin + std::chrono::microseconds(100) * i)) ++passed, left_out += *more;
  }
  EXPECT_EQ(passed, 10U * LogThrottle::kLinesPerSecond);
  EXPECT_LE(passed + left_out, 100'000U);
  EXPECT_GT(passed + left_out, 89'000U) << "of the last second they are not counted yet";
}

}  // namespace
}  // namespace tessera::telemetry
