#include "agent/worker_budget.h"

#include <gtest/gtest.h>

#include <chrono>

namespace tessera::agent {
namespace {

constexpr TimePoint kBegin = TimePoint(std::chrono::hours(1));

TEST(WorkerBudgetTest, AProcessThatTalksWithoutEndIsRefusedAndOthersAreNot) {
  WorkerBudget budget({.per_s = 10, .burst = 3}, {.per_s = 1000, .burst = 1000});
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(budget.Take(7, kBegin, 1));
  EXPECT_FALSE(budget.Take(7, kBegin, 1));
  EXPECT_TRUE(budget.Take(8, kBegin, 1));
  EXPECT_TRUE(budget.Take(7, kBegin + std::chrono::milliseconds(101), 1));
}

TEST(WorkerBudgetTest, BytesCountAsWell) {
  WorkerBudget budget({.per_s = 10, .burst = 10}, {.per_s = 100, .burst = 1000});
  EXPECT_TRUE(budget.Take(7, kBegin, 900));
  EXPECT_FALSE(budget.Take(7, kBegin, 900));
  EXPECT_TRUE(budget.Take(7, kBegin + std::chrono::seconds(8), 900));
}

TEST(WorkerBudgetTest, AnHonestWorkerAtItsBusiestStaysBelow) {
  WorkerBudget budget;
  TimePoint now = kBegin;
  EXPECT_TRUE(budget.Take(7, now, kMaxWorkerMessageBytes)) << "an inventory of a million bodies";
  for (int i = 0; i < 10'000; ++i) {
    now += std::chrono::milliseconds(4);
    ASSERT_TRUE(budget.Take(7, now, 30'000)) << "a report a tick that lists ten thousand players, at " << i;
  }
}

TEST(WorkerBudgetTest, ProcessesThatAreQuietAreForgotten) {
  WorkerBudget budget({.per_s = 10, .burst = 10}, {.per_s = 100, .burst = 100});
  budget.Take(7, kBegin, 50);
  budget.Prune(kBegin + std::chrono::milliseconds(100));
  EXPECT_EQ(budget.processes(), 1u);
  budget.Prune(kBegin + std::chrono::seconds(2));
  EXPECT_EQ(budget.processes(), 0u);
}

}  // namespace
}  // namespace tessera::agent
