#include "control_plane/turn_lock.h"

#include <gtest/gtest.h>

#include <chrono>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace tessera::control {
namespace {

using std::chrono::milliseconds;

// An ordinary thread that waits for the lock, which this one holds, and then an urgent one.
class TurnOrderTest : public testing::Test {
 protected:
  TurnOrderTest() { turns_.lock(); }

  void Begin() {
    ordinary_ = std::thread([this] {
      const std::lock_guard lock(turns_);
      order_ += 'o';
    });
    AwaitWaiting(1);
    urgent_ = std::thread([this] {
      UrgentTurn turn(turns_);
      const std::lock_guard lock(turn);
      order_ += 'u';
    });
    AwaitWaiting(2);
  }
  std::string GiveBack() {
    turns_.unlock();
    ordinary_.join();
    urgent_.join();
    return order_;
  }
  void AwaitWaiting(int count) const {
    while (turns_.waiting() < count) std::this_thread::yield();
  }

  TurnLock turns_;
  std::string order_;  // under the lock
  std::thread ordinary_, urgent_;
};

TEST_F(TurnOrderTest, AnUrgentOneGoesBeforeThoseThatWaitAlready) {
  Begin();
  EXPECT_EQ(GiveBack(), "uo");
}

TEST_F(TurnOrderTest, AnOrdinaryOneIsServedOnceItHasWaitedForLong) {
  Begin();
  EXPECT_FALSE(turns_.try_lock_for(TurnLock::kOrdinaryPatience + milliseconds(1))) << "all have waited so long";
  EXPECT_EQ(GiveBack(), "ou");
}

TEST(TurnLockTest, PlayersComeAfterOperators) {
  TurnLock turns;
  const auto begun = std::chrono::steady_clock::now();
  std::string order;  // under the lock
  turns.lock();
  std::vector<std::thread> threads;
  const auto begin = [&](auto go) {
    threads.emplace_back(go);
    while (turns.waiting() < static_cast<int>(threads.size())) std::this_thread::yield();
  };
  for (int i = 0; i < 3; ++i) {
    begin([&] {
      LastTurn turn(turns);
      const std::lock_guard lock(turn);
      order += 'p';
    });
  }
  begin([&] {
    const std::lock_guard lock(turns);
    order += 'o';
  });
  // Nothing fails on a machine that took so long to get here: players are overdue by then, and come first.
  const bool overdue = std::chrono::steady_clock::now() - begun > TurnLock::kOrdinaryPatience / 2;
  turns.unlock();
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(order.size(), 4u);
  if (overdue) GTEST_SKIP() << "four threads took longer to start than players wait: " << order;
  EXPECT_EQ(order, "oppp");
}

TEST(TurnLockTest, OneAtATimeHoldsIt) {
  TurnLock turns;
  int count = 0;
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&turns, &count, i] {
      for (int n = 0; n < 2000; ++n) {
        if (i % 2 == 0) {
          const std::lock_guard lock(turns);
          ++count;
        } else {
          UrgentTurn urgent(turns);
          const std::lock_guard lock(urgent);
          ++count;
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(count, 8000);
  EXPECT_EQ(turns.waiting(), 0);
}

TEST(TurnLockTest, WhoGivesUpLeavesItToTheOthers) {
  TurnLock turns;
  turns.lock();
  EXPECT_FALSE(turns.try_lock_for(milliseconds(1)));
  EXPECT_EQ(turns.waiting(), 0);
  turns.unlock();
  EXPECT_TRUE(turns.try_lock_for(milliseconds(1)));
  turns.unlock();
}

}  // namespace
}  // namespace tessera::control
