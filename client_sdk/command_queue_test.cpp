#include "client_sdk/command_queue.h"

#include <gmock/gmock.h>

#include <optional>

#include "core/replication/command.h"

namespace tessera::client {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class CommandQueueTest : public ::testing::Test {
 protected:
  std::vector<std::string> Written() {
    const std::vector<std::uint8_t> bytes = queue.Write(now, 0);
    const auto read = replication::DecodeCommands(bytes);
    EXPECT_TRUE(read.ok()) << read.status();
    base = read->base;
    std::vector<std::string> texts;
    for (const replication::Command& command : read->commands) texts.emplace_back(command.bytes);
    return texts;
  }

  CommandQueue queue;
  CommandQueue::TimePoint now{std::chrono::hours(1)};
  std::uint32_t base = 0;
};

TEST_F(CommandQueueTest, WaitsForTheFirstWordOfARegion) {
  ASSERT_TRUE(queue.Push("a").ok());
  EXPECT_FALSE(queue.Due(now));
  queue.Taken(10);
  ASSERT_TRUE(queue.Due(now));
  EXPECT_THAT(Written(), ElementsAre("a"));
  EXPECT_GT(base, 10U + CommandQueue::kMaxPending) << "an earlier process may have had so many under way";
}

TEST_F(CommandQueueTest, RepeatsUntilTakenAndSendsNewOnesAtOnce) {
  queue.Taken(0);
  ASSERT_TRUE(queue.Push("a").ok());
  EXPECT_THAT(Written(), ElementsAre("a"));
  EXPECT_FALSE(queue.Due(now));
  ASSERT_TRUE(queue.Push("b").ok());
  ASSERT_TRUE(queue.Due(now));
  EXPECT_THAT(Written(), ElementsAre("a", "b"));
  queue.Taken(base);
  EXPECT_FALSE(queue.Due(now));
  now += CommandQueue::kRepeat;
  ASSERT_TRUE(queue.Due(now));
  EXPECT_THAT(Written(), ElementsAre("b"));
  queue.Taken(base);
  now += CommandQueue::kRepeat;
  EXPECT_FALSE(queue.Due(now));
}

TEST_F(CommandQueueTest, WhatARegionWillNeverTakeIsLeftOut) {
  queue.Taken(0);
  ASSERT_TRUE(queue.Push("a").ok());
  ASSERT_TRUE(queue.Push("b").ok());
  EXPECT_THAT(Written(), ElementsAre("a", "b"));
  queue.Drop(base + 1);
  EXPECT_EQ(queue.pending(), 2U) << "only the first is decided on";
  queue.Drop(base);
  EXPECT_THAT(Written(), ElementsAre("b"));
}

TEST_F(CommandQueueTest, RefusesWhatIsTooLongOrTooMuch) {
  EXPECT_EQ(queue.Push(std::string(2048, 'x')).message(), "bytes: 2048 are more than 1024");
  for (std::size_t i = 0; i < CommandQueue::kMaxPending; ++i) ASSERT_TRUE(queue.Push("x").ok());
  EXPECT_TRUE(absl::IsResourceExhausted(queue.Push("x")));
}

TEST_F(CommandQueueTest, SaysAFewTimesThatEventsAreHere) {
  queue.EventsCame();
  for (int i = 0; i < CommandQueue::kAcknowledgements; ++i) {
    ASSERT_TRUE(queue.Due(now));
    EXPECT_THAT(Written(), IsEmpty());
    now += CommandQueue::kRepeat;
  }
  EXPECT_FALSE(queue.Due(now));
}

TEST_F(CommandQueueTest, OneThatGoesWithAnInputIsRepeatedAsSoonAsThatIs) {
  EXPECT_FALSE(queue.next().has_value()) << "no region has spoken";
  queue.Taken(0);
  const std::optional<std::uint32_t> number = queue.next();
  ASSERT_TRUE(number.has_value());
  ASSERT_TRUE(queue.Push("throw", 0, 9).ok());
  EXPECT_THAT(Written(), ElementsAre("throw"));
  EXPECT_EQ(base, *number);
  EXPECT_EQ(queue.next(), *number + 1);
  for (int i = 0; i < CommandQueue::kHurried; ++i) {
    EXPECT_FALSE(queue.Due(now));
    now += CommandQueue::kHurry;
    ASSERT_TRUE(queue.Due(now));
    EXPECT_THAT(Written(), ElementsAre("throw"));
  }
  now += CommandQueue::kHurry;
  EXPECT_FALSE(queue.Due(now)) << "then as all others";
  now += CommandQueue::kRepeat;
  EXPECT_TRUE(queue.Due(now));
}

}  // namespace
}  // namespace tessera::client
