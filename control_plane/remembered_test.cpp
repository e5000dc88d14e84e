#include "control_plane/remembered.h"

#include <gtest/gtest.h>

namespace tessera::control {
namespace {

using std::chrono::milliseconds;

TEST(RememberedTest, HoweverOftenOneAsksItIsFoundOnceASecond) {
  int found = 0;
  Remembered<int> number([&found] { return ++found; });
  const Remembered<int>::Clock::time_point begin{std::chrono::hours(1)};
  for (int ms = 0; ms < 10'000; ++ms) EXPECT_EQ(number.Get(begin + milliseconds(ms)), 1 + ms / 1000) << ms;
  EXPECT_EQ(found, 10);
}

}  // namespace
}  // namespace tessera::control
