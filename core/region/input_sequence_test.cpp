#include "core/region/input_sequence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace tessera::region {
namespace {

using Order = InputSequence::Order;

TEST(InputSequenceTest, EachNumberCountsOnce) {
  InputSequence sequence;
  for (std::uint32_t number = 1; number <= 200; ++number) {
    EXPECT_EQ(sequence.Decide(number), Order::kNewest);
    for (std::uint32_t copy = number; copy > 0; --copy) EXPECT_EQ(sequence.Decide(copy), Order::kRepeated);
  }
}

TEST(InputSequenceTest, ALateNumberIsLateOnceAndThenRepeated) {
  InputSequence sequence;
  EXPECT_EQ(sequence.Decide(10), Order::kNewest);
  EXPECT_EQ(sequence.Decide(9), Order::kLate);
  EXPECT_EQ(sequence.Decide(9), Order::kRepeated);
  EXPECT_EQ(sequence.Decide(0), Order::kRepeated);  // no input has it
  EXPECT_EQ(sequence.Decide(10 + InputSequence::kWindow), Order::kNewest);
  EXPECT_EQ(sequence.Decide(11), Order::kLate);
  EXPECT_EQ(sequence.Decide(8), Order::kRepeated);  // too old to know
}

TEST(InputSequenceTest, AgreesWithASetWhateverTheOrder) {
  std::mt19937 random(3);
  InputSequence sequence;
  std::set<std::uint32_t> seen;
  for (int i = 0; i < 10'000; ++i) {
    const std::uint32_t newest = seen.empty() ? 0 : *seen.rbegin();
    const std::uint32_t back = static_cast<std::uint32_t>(random()) % 40,
                        ahead = static_cast<std::uint32_t>(random()) % 3;
    const std::uint32_t number = std::max(newest + ahead, back + 1) - back;
    const Order order = sequence.Decide(number);
    if (!seen.insert(number).second) {
      EXPECT_EQ(order, Order::kRepeated);
    } else {
      EXPECT_EQ(order, number > newest ? Order::kNewest : Order::kLate);
    }
  }
}

}  // namespace
}  // namespace tessera::region
