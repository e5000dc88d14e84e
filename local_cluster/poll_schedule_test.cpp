#include "local_cluster/poll_schedule.h"

#include <gtest/gtest.h>

#include <map>

namespace tessera::local {
namespace {

using std::chrono::milliseconds;

constexpr PollSchedule::Time kBegin{};

TEST(PollScheduleTest, EachIsPolledOnceAPeriodAndNoTwoTogether) {
  PollSchedule schedule(milliseconds(40), 4);
  for (std::size_t i = 0; i < 4; ++i) schedule.Add(i, kBegin);
  std::map<std::size_t, int> polls;
  for (int ms = 0; ms < 400; ++ms) {
    int at_once = 0;
    while (const auto due = schedule.Take(kBegin + milliseconds(ms))) {
      ++polls[*due];
      ++at_once;
    }
    EXPECT_LE(at_once, 1) << ms;
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(polls[i], 10) << i;
  EXPECT_EQ(schedule.taken(), 40U);
  EXPECT_EQ(schedule.late(), 0U);
}

// A poll that takes longer than its share: all are polled less often, equally, and nothing piles up.
TEST(PollScheduleTest, WhoIsTooSlowPollsLessOftenAndNeverTwiceInARow) {
  PollSchedule schedule(milliseconds(10), 5);
  for (std::size_t i = 0; i < 5; ++i) schedule.Add(i, kBegin);
  PollSchedule::Time now = kBegin;
  std::map<std::size_t, int> polls;
  std::optional<std::size_t> last;
  while (now < kBegin + milliseconds(1000)) {
    if (const auto due = schedule.Take(now)) {
      EXPECT_NE(due, last);
      last = due;
      ++polls[*due];
      now += milliseconds(5);
    } else {
      now = *schedule.next();
    }
  }
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(polls[i], 40, 2) << i;
  EXPECT_NEAR(static_cast<double>(schedule.taken() + schedule.late()), 500, 15) << "each slot is made or counted";
  const auto stalled = now + milliseconds(10'000);
  int at_once = 0;
  while (schedule.Take(stalled)) ++at_once;
  EXPECT_EQ(at_once, 5) << "one each after a standstill";
}

TEST(PollScheduleTest, WhoHasLeftIsNotPolled) {
  PollSchedule schedule(milliseconds(10), 2);
  EXPECT_FALSE(schedule.next().has_value());
  schedule.Add(0, kBegin);
  schedule.Add(1, kBegin);
  schedule.Remove(0);
  EXPECT_EQ(schedule.Take(kBegin + milliseconds(9)), 1U);
  EXPECT_FALSE(schedule.Take(kBegin + milliseconds(9)).has_value());
}

}  // namespace
}  // namespace tessera::local
