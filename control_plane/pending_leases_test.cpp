// Leases that wait for a host that does not read stay bounded, and are the newest.
#include "control_plane/pending_leases.h"

#include <gtest/gtest.h>

#include "control_plane/control_settings.h"

namespace tessera::control {
namespace {

v1::LeaseRenewal Renewal(std::uint64_t incarnation, std::uint64_t number) {
  v1::LeaseRenewal renewal;
  renewal.mutable_identity()->set_instance_id("inst-1");
  renewal.mutable_identity()->set_region(1);
  renewal.mutable_identity()->set_incarnation(incarnation);
  renewal.set_number(number);
  return renewal;
}

TEST(PendingLeasesTest, TheNewestOfEachWorkerIsKeptAndTheFirstThatAskedGoesFirst) {
  PendingLeases leases;
  for (std::uint64_t number = 1; number <= 100'000; ++number) leases.Put(Renewal(1 + number % 2, number));
  EXPECT_EQ(leases.size(), 2U);
  EXPECT_EQ(leases.Take()->number(), 99'999U) << "of worker 2, which asked first";
  leases.Put(Renewal(2, 100'001));
  EXPECT_EQ(leases.Take()->number(), 100'000U);
  EXPECT_EQ(leases.Take()->number(), 100'001U);
  EXPECT_FALSE(leases.Take());
  EXPECT_TRUE(leases.empty());
}

TEST(PendingLeasesTest, ThereAreNoMoreThanAHostHasWorkers) {
  PendingLeases leases;
  for (std::uint64_t worker = 1; worker <= kMaxNamedWorkers + 10; ++worker) leases.Put(Renewal(worker, worker));
  EXPECT_EQ(leases.size(), kMaxNamedWorkers);
  EXPECT_EQ(leases.Take()->number(), 11U) << "the oldest went";
}

}  // namespace
}  // namespace tessera::control
