#include "region_worker/longest_tick.h"

#include <gtest/gtest.h>

namespace tessera::worker {
namespace {

using std::chrono::milliseconds;

TEST(LongestTickTest, IsKeptForOneSpanMoreThanItsOwn) {
  LongestTick longest;
  TimePoint now{};
  longest.Add(now += milliseconds(1), {.whole = milliseconds(40), .worked = milliseconds(3)});
  longest.Add(now += LongestTick::kSpan, {.whole = milliseconds(16), .worked = milliseconds(5)});
  EXPECT_EQ(longest.longest().whole, milliseconds(40));
  EXPECT_EQ(longest.longest().worked, milliseconds(5)) << "of another tick";
  longest.Add(now += milliseconds(1), {.whole = milliseconds(17)});
  EXPECT_EQ(longest.longest().whole, milliseconds(40)) << "of the span before";
  longest.Add(now += LongestTick::kSpan + milliseconds(1), {.whole = milliseconds(18)});
  EXPECT_EQ(longest.longest().whole, milliseconds(18));
}

}  // namespace
}  // namespace tessera::worker
