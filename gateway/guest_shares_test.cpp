#include "gateway/guest_shares.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

namespace tessera::gateway {
namespace {

using std::chrono::milliseconds;

constexpr GuestShares::TimePoint kBegin{std::chrono::hours(1)};
constexpr int kAtOnce = static_cast<int>(kGuestsOfAVisitor.burst);

// How many of a hundred at that time are let in.
int TakenAt(GuestShares& guests, GuestShares::TimePoint now, const std::string& address) {
  int taken = 0;
  for (int i = 0; i < 100; ++i) taken += guests.Take(now, address) ? 1 : 0;
  return taken;
}

TEST(GuestSharesTest, AnAddressHasSomeAtOnceAndOneNowAndThenAndOthersHaveTheirs) {
  GuestShares guests;
  EXPECT_EQ(TakenAt(guests, kBegin, "10.0.0.7"), kAtOnce);
  EXPECT_EQ(TakenAt(guests, kBegin, "10.0.0.8"), kAtOnce);
  EXPECT_FALSE(guests.Take(kBegin + std::chrono::seconds(kGuestAgain_s) - milliseconds(1), "10.0.0.7"));
  EXPECT_EQ(TakenAt(guests, kBegin + std::chrono::seconds(kGuestAgain_s), "10.0.0.7"), 1);
}

TEST(GuestSharesTest, OfIpv6ANetworkCountsAndOfAMappedAddressTheOneWithinIt) {
  GuestShares guests;
  EXPECT_EQ(TakenAt(guests, kBegin, "2001:db8:1:2::1"), kAtOnce);
  EXPECT_EQ(TakenAt(guests, kBegin, "2001:db8:1:2:ffff::9"), 0);
  EXPECT_EQ(TakenAt(guests, kBegin, "2001:db8:1:3::1"), kAtOnce);
  EXPECT_EQ(TakenAt(guests, kBegin, "::ffff:10.0.0.7"), kAtOnce);
  EXPECT_EQ(TakenAt(guests, kBegin, "::ffff:10.0.0.8"), kAtOnce);
}

TEST(GuestSharesTest, WhoseAddressIsNotKnownIsNotCounted) {
  GuestShares guests;
  EXPECT_EQ(TakenAt(guests, kBegin, ""), 100);
}

}  // namespace
}  // namespace tessera::gateway
