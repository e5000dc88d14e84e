#include "control_plane/stream_deadlines.h"

#include <gtest/gtest.h>

#include <future>
#include <thread>

namespace tessera::control {
namespace {

using namespace std::chrono_literals;

TEST(StreamDeadlinesTest, WhoSaysNothingIsCancelled) {
  StreamDeadlines deadlines(1ms, 4);
  std::promise<void> cancelled;
  const auto waiting = deadlines.Begin([&] { cancelled.set_value(); });
  ASSERT_NE(waiting, nullptr);
  cancelled.get_future().wait();
  EXPECT_FALSE(waiting->End());
}

TEST(StreamDeadlinesTest, WhoSpeaksInTimeIsLeftAlone) {
  StreamDeadlines deadlines(1h, 4);
  bool cancelled = false;
  const auto waiting = deadlines.Begin([&] { cancelled = true; });
  EXPECT_TRUE(waiting->End());
  EXPECT_TRUE(waiting->End()) << "asked again, it says the same";
  EXPECT_FALSE(cancelled);
}

// The one that is waited for ends, and another begins, which wakes the thread: under asan what it reads then is seen.
TEST(StreamDeadlinesTest, StreamsEndWhileTheyAreWaitedFor) {
  StreamDeadlines deadlines(1h, 4);
  for (int i = 0; i < 2000; ++i) {
    const auto first = deadlines.Begin([] {});
    ASSERT_NE(first, nullptr);
    std::this_thread::yield();
    EXPECT_TRUE(first->End());
  }
}

TEST(StreamDeadlinesTest, FewWaitAtATime) {
  StreamDeadlines deadlines(1h, 2);
  const auto first = deadlines.Begin([] {});
  auto second = deadlines.Begin([] {});
  EXPECT_EQ(deadlines.Begin([] {}), nullptr);
  second.reset();
  EXPECT_NE(deadlines.Begin([] {}), nullptr);
}

}  // namespace
}  // namespace tessera::control
