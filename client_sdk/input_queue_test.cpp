#include "client_sdk/input_queue.h"

#include <gtest/gtest.h>

namespace tessera::client {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kTickLength{16};
const InputQueue::TimePoint kStart = InputQueue::TimePoint() + std::chrono::hours(1);

std::vector<std::uint32_t> Numbers(const InputQueue& queue) {
  std::vector<std::uint32_t> numbers;
  for (const PlayerInput& input : queue.Select([](BodyId) { return true; })) numbers.push_back(input.number);
  return numbers;
}

TEST(InputQueueTest, SendsAnInputAtOnceAndThenOnceATickThreeTimesInAll) {
  InputQueue queue;
  EXPECT_FALSE(queue.Due(kStart, kTickLength));
  queue.Push({.number = 1});
  for (int sending = 0; sending < InputQueue::kSendings; ++sending) {
    const auto now = kStart + sending * kTickLength;
    EXPECT_TRUE(queue.Due(now, kTickLength));
    queue.Sent(now);
    EXPECT_FALSE(queue.Due(now + kTickLength - milliseconds(1), kTickLength));
  }
  EXPECT_FALSE(queue.Due(kStart + 10 * kTickLength, kTickLength));
  EXPECT_TRUE(Numbers(queue).empty());
}

TEST(InputQueueTest, ANewInputTakesTheOthersAlong) {
  InputQueue queue;
  queue.Push({.number = 1});
  queue.Sent(kStart);
  queue.Push({.number = 2});
  EXPECT_TRUE(queue.Due(kStart, kTickLength));
  EXPECT_EQ(Numbers(queue), (std::vector<std::uint32_t>{1, 2}));
}

TEST(InputQueueTest, SelectsByBody) {
  InputQueue queue;
  queue.Push({.number = 1, .body = BodyId(5)});
  queue.Push({.number = 2, .body = BodyId(6)});
  const std::vector<PlayerInput> selected = queue.Select([](BodyId body) { return body == BodyId(6); });
  ASSERT_EQ(selected.size(), 1u);
  EXPECT_EQ(selected[0].number, 2u);
}

TEST(InputQueueTest, DropsTheOldestBeyondAMessage) {
  InputQueue queue;
  for (std::uint32_t number = 1; number <= replication::kMaxInputs + 2; ++number) queue.Push({.number = number});
  EXPECT_EQ(Numbers(queue).size(), replication::kMaxInputs);
  EXPECT_EQ(Numbers(queue).front(), 3u);
}

}  // namespace
}  // namespace tessera::client
