// A lease as etcd tells it, second by second, and whether its leader is silent.
#include "control_plane/etcd/lease_watch.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace tessera::control {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kTerm = 7;
constexpr auto kAnswer = 1ms;  // nobody is told of a lease in the moment of its renewal

class LeaseWatchTest : public ::testing::Test {
 protected:
  // A lease that has so much left is asked for each fifth of a second until it is found to be silent or `span` is over.
  // `renew_every` 0: nobody renews it. Returns how long that took; `span`: it never was.
  std::chrono::milliseconds Watch(std::chrono::milliseconds left, std::chrono::seconds granted,
                                  std::chrono::milliseconds renew_every, std::chrono::milliseconds span) {
    std::chrono::milliseconds renewed{0};
    for (std::chrono::milliseconds passed{0}; passed < span; passed += 200ms, now_ += 200ms) {
      if (renew_every > 0ms && passed - renewed >= renew_every) {
        renewed = passed;
        left = granted - kAnswer;
      }
      if (watch_.IsSilent(kTerm, {.left = std::chrono::floor<std::chrono::seconds>(left), .granted = granted}, now_)) {
        return passed;
      }
      left -= 200ms;
    }
    return span;
  }

  LeaseWatch watch_;
  LeaseWatch::Clock::time_point now_{};
};

TEST_F(LeaseWatchTest, ALeaseThatNobodyRenewsIsSilentOnceThreeQuartersHavePassed) {
  EXPECT_EQ(Watch(3900ms, 4s, 0ms, 10s), 3000ms);
}

TEST_F(LeaseWatchTest, OneThatIsRenewedIsNot) {
  EXPECT_EQ(Watch(4s - kAnswer, 4s, 600ms, 60s), 60s);
  EXPECT_EQ(Watch(4s - kAnswer, 4s, 2800ms, 60s), 60s) << "late, and in time";
}

TEST_F(LeaseWatchTest, OneThatStopsBeingRenewedIsFoundOut) {
  EXPECT_EQ(Watch(4s - kAnswer, 4s, 600ms, 20s), 20s);
  EXPECT_LE(Watch(4s - kAnswer, 4s, 0ms, 10s), 3200ms);
}

// By the time of its election it has more left than it was granted.
TEST_F(LeaseWatchTest, WhatAnElectionOfEtcdAddsIsNotWaitedFor) {
  EXPECT_FALSE(watch_.IsSilent(kTerm, {.left = 9'000'000'000s, .granted = 4s}, now_)) << "not looked at yet";
  EXPECT_LE(Watch(5s - kAnswer, 4s, 0ms, 10s), 3200ms);
}

TEST_F(LeaseWatchTest, AnElectionOfEtcdLeavesALeaderThatRenewsItsTime) {
  EXPECT_EQ(Watch(5s - kAnswer, 4s, 600ms, 20s), 20s);
  EXPECT_GE(Watch(4s - kAnswer, 4s, 0ms, 10s), 3000ms) << "no sooner for that it had had more";
}

TEST_F(LeaseWatchTest, AnotherTermBeginsAnew) {
  EXPECT_FALSE(watch_.IsSilent(kTerm, {.left = 4s, .granted = 4s}, now_));
  EXPECT_FALSE(watch_.IsSilent(kTerm + 1, {.left = 1s, .granted = 4s}, now_)) << "and is not of the first one's top";
}

TEST_F(LeaseWatchTest, OfAShortOneNothingIsSaid) {
  for (const auto granted : {1s, 2s, 3s})
    EXPECT_EQ(Watch(granted - kAnswer, granted, 0ms, granted), granted) << granted.count();
}

}  // namespace
}  // namespace tessera::control
