#include "region_worker/core/lease.h"

#include <gtest/gtest.h>

#include "region_worker/testing/regions.h"

namespace tessera::worker {
namespace {

using std::chrono::milliseconds;

// One that was given at kStart.
Lease HeldLease() {
  Lease lease;
  lease.Require();
  lease.Renewed(kStart);
  return lease;
}

bool EndsAt(const Lease& lease, TimePoint time) { return lease.Held(time - Duration(1)) && !lease.Held(time); }

TEST(LeaseTest, WithoutAStandbyNoneIsNeeded) {
  Lease lease;
  EXPECT_TRUE(lease.Held(kStart));
  EXPECT_FALSE(lease.Ask(kStart).has_value());
  lease.Require();
  EXPECT_FALSE(lease.Held(kStart)) << "the first one has to be asked for";
  lease.Release();
  EXPECT_TRUE(lease.Held(kStart + std::chrono::hours(1)));
}

TEST(LeaseTest, AStandbyThatIsNoneAnyMoreRenewsNothing) {
  Lease lease = HeldLease();
  lease.Release();
  lease.Renewed(kStart + milliseconds(500));
  lease.Require();
  EXPECT_FALSE(lease.Held(kStart + milliseconds(1)));
}

TEST(LeaseTest, EndsOneTtlAfterTheAskingNotTheAnswer) {
  Lease lease = HeldLease();
  lease.Renewed(kStart + milliseconds(400));  // the answer may have come much later
  EXPECT_TRUE(lease.Held(kStart + milliseconds(400) + Lease::kTtl - milliseconds(1)));
  EXPECT_FALSE(lease.Held(kStart + milliseconds(400) + Lease::kTtl));
}

TEST(LeaseTest, AnOldRenewalShortensNothing) {
  Lease lease = HeldLease();
  lease.Renewed(kStart + milliseconds(500));
  lease.Renewed(kStart + milliseconds(100));
  EXPECT_TRUE(lease.Held(kStart + milliseconds(1400)));
}

TEST(LeaseTest, RequiringItAgainGivesNoNewOne) {
  Lease lease = HeldLease();
  lease.Require();
  EXPECT_FALSE(lease.Held(kStart + Lease::kTtl));
}

TEST(LeaseTest, IsAskedForOnlyWhenTheStandbyIsSilent) {
  Lease lease = HeldLease();
  EXPECT_FALSE(lease.Ask(kStart).has_value());
  EXPECT_FALSE(lease.Ask(kStart + Lease::kTtl - Lease::kAskBelow).has_value());
  const TimePoint ask = kStart + Lease::kTtl - Lease::kAskBelow + milliseconds(1);
  const auto number = lease.Ask(ask);
  ASSERT_TRUE(number.has_value());
  EXPECT_FALSE(lease.Ask(ask + milliseconds(1)).has_value()) << "not at once again";
  EXPECT_TRUE(lease.Ask(ask + Lease::kAskDistance).has_value());

  lease.Answered(*number + 7, Lease::kTtl);  // was never asked
  EXPECT_TRUE(EndsAt(lease, kStart + Lease::kTtl));
  lease.Answered(*number, Lease::kTtl);
  EXPECT_TRUE(EndsAt(lease, ask + Lease::kTtl));
}

TEST(LeaseTest, AShorterTtlOfTheGiverCounts) {
  Lease lease = HeldLease();
  const TimePoint ask = kStart + milliseconds(900);
  lease.Answered(lease.Ask(ask).value(), milliseconds(300));
  EXPECT_TRUE(EndsAt(lease, ask + milliseconds(300)));
}

TEST(LeaseTest, OneThatEndedComesBackWithARenewal) {
  Lease lease = HeldLease();
  const TimePoint later = kStart + std::chrono::seconds(9);
  EXPECT_FALSE(lease.Held(later));
  lease.Answered(lease.Ask(later).value(), Lease::kTtl);
  EXPECT_TRUE(lease.Held(later + milliseconds(1)));
}

}  // namespace
}  // namespace tessera::worker
