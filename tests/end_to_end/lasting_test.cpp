// Three control planes, three members of etcd, three hosts, and faults drawn from a seed: nothing that was acknowledged
// is lost, one leader writes at a time, no place has two owners, and what is said is so. A program of its own: it
// leaves this machine's network before anything else.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "bench/lasting_run.h"
#include "bench/small_disk.h"

namespace tessera::end_to_end {
namespace {

using ::testing::IsEmpty;

// The long run is `./dev bench lasting`; here two faults of the leader and three of stores and disks come once, as
// short as they go.
constexpr std::uint64_t kSeed = 31;
constexpr double kHold_s = 2;
// Nobody is told of a death sooner than others know of it; a busy machine tells later, but not for ever.
constexpr double kLongestLie_s = 15;

TEST(LastingTest, WhateverDiesNothingIsLostOrDoubledOrMisstated) {
  setenv("TESSERA_BIN", TESSERA_BINARY_DIR "/bin", 1);
  absl::Status own = local::EnterOwnNetwork();
  if (own.ok()) own = bench::EnterOwnMounts();
  auto network = own.ok() ? local::HostNetwork::Create(bench::LastingStage::kMachines)
                          : absl::StatusOr<std::unique_ptr<local::HostNetwork>>(own);
  if (!network.ok()) GTEST_SKIP() << "no namespaces here: " << network.status();
  std::vector<bench::LastingFault> faults = bench::DrawFaults(kSeed, 5);
  for (bench::LastingFault& fault : faults) fault.hold_s = std::min(fault.hold_s, kHold_s);
  const auto verdict = bench::RunLasting(
      **network, {.faults = faults, .tell = [](const std::string& line) { std::cout << line << std::endl; }});
  ASSERT_TRUE(verdict.ok()) << verdict.status();
  EXPECT_THAT(verdict->not_well, IsEmpty());
  EXPECT_THAT(verdict->lost, IsEmpty());
  EXPECT_THAT(verdict->two_writers, IsEmpty());
  EXPECT_THAT(verdict->two_owners, IsEmpty());
  EXPECT_THAT(verdict->players_dropped, IsEmpty());
  EXPECT_LT(verdict->false_running.longest_s, kLongestLie_s) << ::testing::PrintToString(verdict->false_running.told);
  // The witnesses were there.
  EXPECT_GT(verdict->changes, 20u);
  EXPECT_GT(verdict->writes, 20u);
  EXPECT_GT(verdict->readings, 200u);
}

}  // namespace
}  // namespace tessera::end_to_end
