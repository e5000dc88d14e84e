// The parts that count, with time as a number.
#include "net/limits.h"

#include <gtest/gtest.h>

#include "net/held_off.h"
#include "net/session_budget.h"

namespace tessera::net {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr TokenBucket::TimePoint kStart{seconds(1000)};

TEST(TokenBucketTest, GivesTheBurstAndThenTheRate) {
  constexpr Rate kRate{.per_s = 10, .burst = 5};
  TokenBucket bucket;
  int taken = 0;
  for (int i = 0; i < 100; ++i) taken += bucket.Take(kStart, kRate) ? 1 : 0;
  EXPECT_EQ(taken, 5);
  for (int ms = 0; ms < 10'000; ++ms) taken += bucket.Take(kStart + milliseconds(ms), kRate) ? 1 : 0;
  EXPECT_NEAR(taken, 5 + 100, 1);
  EXPECT_FALSE(bucket.Take(kStart, kRate));  // a clock that goes back gives nothing
  taken = 0;
  for (int i = 0; i < 100; ++i) taken += bucket.Take(kStart + seconds(100'000), kRate) ? 1 : 0;
  EXPECT_EQ(taken, 5);  // a long pause saves up no more than the burst
}

constexpr SessionLimits kLimits{
    .datagrams = {.per_s = 100, .burst = 10}, .bytes = {.per_s = 10'000, .burst = 1000}, .patience = seconds(2)};

// Sends `per_ms` datagrams of `bytes` in each millisecond; whether it began to flood, and how many were let through.
struct Outcome {
  bool floods = false;
  int passed = 0;
};
Outcome Send(SessionBudget& budget, TokenBucket::TimePoint from, milliseconds span, int per_ms, std::size_t bytes,
             bool proven = true) {
  Outcome outcome;
  for (auto now = from; now < from + span; now += milliseconds(1)) {
    for (int i = 0; i < per_ms; ++i) {
      if (budget.Take(now, kLimits, bytes)) {
        ++outcome.passed;
        budget.Opened(proven);
      } else {
        outcome.floods |= budget.BeginsToFlood(now, kLimits);
      }
    }
  }
  return outcome;
}

TEST(SessionBudgetTest, CountsDatagramsAndBytes) {
  SessionBudget many, large;
  EXPECT_NEAR(Send(many, kStart, seconds(1), 1, 1).passed, 110, 1);
  EXPECT_NEAR(Send(large, kStart, seconds(1), 1, 1000).passed, 11, 1);
}

TEST(SessionBudgetTest, WithoutLimitsTakesAll) {
  SessionBudget budget;
  for (int i = 0; i < 10'000; ++i) ASSERT_TRUE(budget.Take(kStart, SessionLimits{}, 1200));
}

TEST(SessionBudgetTest, OnlyALongFloodIsOne) {
  SessionBudget budget;
  EXPECT_FALSE(Send(budget, kStart, milliseconds(1900), 8, 1).floods);
  // A pause, as after a network that stalled: it begins anew.
  EXPECT_FALSE(Send(budget, kStart + seconds(4), milliseconds(1900), 8, 1).floods);
  EXPECT_TRUE(Send(budget, kStart + milliseconds(5900), milliseconds(200), 8, 1).floods);
  EXPECT_FALSE(Send(budget, kStart + milliseconds(6100), seconds(5), 8, 1).floods);  // said once
}

// Somebody on the network between sends in the peer's name.
TEST(SessionBudgetTest, ForgedDatagramsEndNobodysSession) {
  SessionBudget budget;
  EXPECT_FALSE(Send(budget, kStart, seconds(10), 8, 1, false).floods);
}

TEST(HeldOffTest, HoldsFromTheThirdTimeOnUntilItsTimeIsOver) {
  HeldOff held_off;
  for (int i = 0; i < kRefusalsAtOnce; ++i) {
    EXPECT_FALSE(held_off.Holds(kStart, 7));
    held_off.Note(kStart, 7);
  }
  EXPECT_TRUE(held_off.Holds(kStart, 7));
  EXPECT_FALSE(held_off.Holds(kStart, 8));
  EXPECT_TRUE(held_off.Holds(kStart + kHoldOff - milliseconds(1), 7));
  EXPECT_FALSE(held_off.Holds(kStart + kHoldOff, 7));
  EXPECT_EQ(held_off.size(), 0u);
}

TEST(HeldOffTest, RemembersABoundedNumber) {
  HeldOff held_off;
  for (std::uint64_t i = 0; i < 3 * kMaxHeldOff; ++i) held_off.Note(kStart, i, kRefusalsAtOnce);
  EXPECT_EQ(held_off.size(), kMaxHeldOff);
  EXPECT_FALSE(held_off.Holds(kStart, 0));
  EXPECT_TRUE(held_off.Holds(kStart, 3 * kMaxHeldOff - 1));
}

}  // namespace
}  // namespace tessera::net
