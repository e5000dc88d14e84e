// Three control planes, three members of etcd, three hosts, and faults drawn from a seed: nothing that was acknowledged
// is lost, one leader writes at a time, no place has two owners, and what is said is so. A program of its own: it
// leaves this machine's network before anything else.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <vector>

#include "bench/lasting_run.h"
#include "bench/small_disk.h"

namespace tessera::end_to_end {
namespace {

using ::testing::IsEmpty;

using Kind = bench::LastingFaultKind;

// The long run is `./dev bench lasting`; here some of the leader, of stores and of disks come once, as short as they
// go.
constexpr Kind kKinds[] = {Kind::kStopLeader,  Kind::kSlowStore, Kind::kStoreMember, Kind::kFullDisk,
                           Kind::kStoreLeader, Kind::kFullStore, Kind::kOldBackup,   Kind::kFullStoreMinute,
                           Kind::kCutLeader,   Kind::kCutBorder};
// The last one holds for longer than it takes to route around a cut.
constexpr double kHold_s = 2, kHoldOfTwo_s = 4.5, kHoldOfCut_s = 25;
// A region that stands still is said to for 2 s at most before it is told. Its worker is read each 0.1 s; an answer may
// take 1.5 s to come, and counts for 0.2 s more, until the next question.
constexpr double kLongestLie_s = 2 + 0.1 + 1.5 + 0.2;
// From a worker to its agent, the control plane and whoever asks: on a busy machine each of them may sleep longer than
// it wants to, and the witness tells by how much one did.
constexpr int kSleepers = 4;

std::vector<bench::LastingFault> ShortFaults() {
  std::vector<bench::LastingFault> faults;
  for (const Kind kind : kKinds) {
    const auto which = static_cast<std::uint32_t>(faults.size()) % bench::kLastingHosts;
    const double hold_s = kind == Kind::kCutBorder ? kHoldOfCut_s : bench::StrikesTwice(kind) ? kHoldOfTwo_s : kHold_s;
    faults.push_back({.kind = kind, .which = which, .hold_s = hold_s});
  }
  return faults;
}

TEST(LastingTest, WhateverDiesNothingIsLostOrDoubledOrMisstated) {
  setenv("TESSERA_BIN", TESSERA_BINARY_DIR "/bin", 1);
  absl::Status own = local::EnterOwnNetwork();
  if (own.ok()) own = bench::EnterOwnMounts();
  auto network = own.ok() ? local::HostNetwork::Create(bench::LastingStage::kMachines)
                          : absl::StatusOr<std::unique_ptr<local::HostNetwork>>(own);
  if (!network.ok()) GTEST_SKIP() << "no namespaces here: " << network.status();
  const auto verdict = bench::RunLasting(
      **network, {.faults = ShortFaults(), .tell = [](const std::string& line) { std::cout << line << std::endl; }});
  ASSERT_TRUE(verdict.ok()) << verdict.status();
  EXPECT_THAT(verdict->not_well, IsEmpty());
  EXPECT_THAT(verdict->lost, IsEmpty());
  EXPECT_THAT(verdict->two_writers, IsEmpty());
  EXPECT_THAT(verdict->two_owners, IsEmpty());
  EXPECT_THAT(verdict->players_dropped, IsEmpty());
  EXPECT_THAT(verdict->cuts_not_told, IsEmpty());
  const double longest_s = kLongestLie_s + kSleepers * verdict->late_s;
  EXPECT_LT(verdict->false_running.longest_s, longest_s) << ::testing::PrintToString(verdict->false_running.told);
  EXPECT_LT(verdict->false_degraded.longest_s, longest_s) << ::testing::PrintToString(verdict->false_degraded.told);
  for (const bench::LastingGap& gap : verdict->gaps) {
    if (!gap.cut) continue;
    EXPECT_LT(gap.cut_outcome.false_running_s, longest_s);
    std::cout << gap.cut->one << " and " << gap.cut->other << " were cut from each other: DEGRADED after "
              << gap.cut_outcome.degraded_s << " s, routed around after " << gap.cut_outcome.routed_s << " s"
              << std::endl;
  }
  std::cout << "a sleep was late by " << verdict->late_s << " s, RUNNING was false for "
            << verdict->false_running.longest_s << " s and DEGRADED for " << verdict->false_degraded.longest_s
            << " s at the longest" << std::endl;
  // The witnesses were there.
  EXPECT_GT(verdict->changes, 20u);
  EXPECT_GT(verdict->writes, 20u);
  EXPECT_GT(verdict->readings, 200u);
}

}  // namespace
}  // namespace tessera::end_to_end
