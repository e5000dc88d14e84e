#include "control_plane/guest_rates.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "control_plane/retry_after.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr GuestLimits kSmall{.of_address = {.per_s = 2, .burst = 3}, .of_instance = {.per_s = 10, .burst = 5}};

constexpr GuestRates::HashKey kTestHashKey{};  // a fixed one: no two of the test's addresses share a bucket

Now After(milliseconds span) { return {.steady = seconds(100) + span, .unix_time = {}}; }

TEST(GuestRatesTest, AnAddressJoinsItsBurstAndThenByItsRate) {
  GuestRates rates(kSmall, kTestHashKey);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(rates.Take(1, "ada", After({})).ok()) << i;
  const absl::Status refused = rates.Take(1, "ada", After({}));
  EXPECT_EQ(refused, WithRetryAfter(absl::ResourceExhaustedError(
                                        "too many guests join from this address: ask again in 1 s, or show a ticket"),
                                    milliseconds(500)));
  EXPECT_EQ(RetryAfterOf(refused), milliseconds(500));
  EXPECT_FALSE(rates.Take(1, "ada", After(milliseconds(499))).ok());
  EXPECT_TRUE(rates.Take(1, "ada", After(milliseconds(501))).ok()) << "who waits as it was told comes in";
}

TEST(GuestRatesTest, OtherAddressesHaveTheirOwnUntilTheInstanceIsBusy) {
  GuestRates rates(kSmall, kTestHashKey);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(rates.Take(1, "ada", After({})).ok());
  EXPECT_TRUE(rates.Take(1, "bob", After({})).ok());
  EXPECT_TRUE(rates.Take(1, "bob", After({})).ok());
  const absl::Status refused = rates.Take(1, "bob", After({}));
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(RetryAfterOf(refused), milliseconds(100));
  EXPECT_TRUE(rates.Take(2, "bob", After({})).ok()) << "the refusal cost bob nothing, and another world is not busy";
}

TEST(GuestRatesTest, AnInstanceThatEndedIsForgotten) {
  GuestRates rates(kSmall, kTestHashKey);
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(rates.Take(1, "", After({})).ok());
  ASSERT_FALSE(rates.Take(1, "", After({})).ok());
  rates.Forget(1);
  EXPECT_TRUE(rates.Take(1, "", After({})).ok());
}

TEST(GuestRatesTest, NoRateIsNoLimit) {
  GuestRates rates({.of_address = {}, .of_instance = {}});
  for (int i = 0; i < 10'000; ++i) ASSERT_TRUE(rates.Take(1, "ada", After({})).ok());
}

TEST(RetryAfterTest, AStatusWithoutOneSaysNone) {
  EXPECT_EQ(RetryAfterOf(absl::ResourceExhaustedError("full")), std::nullopt);
  EXPECT_EQ(RetryAfterOf(absl::OkStatus()), std::nullopt);
}

}  // namespace
}  // namespace tessera::control
