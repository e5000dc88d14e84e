// LeaderScenario: a deployment with several control planes on one store, and faults of leaders, of the store and of
// what lies between, drawn from one seed; and what came of running it.
//
//   const LeaderScenario scenario = DrawLeaders(17);
//   const LeaderOutcome outcome = Run(scenario);
//
// None of these faults may cost a body or a change that was acknowledged, give a region two owners, or make anybody say
// what is not so. As in deployment_scenario.h, those that take a region from the world come one at a time.
// Thread rule: free functions on values.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/simulation/drawn_fault.h"

namespace tessera::simulation {

enum class LeaderFaultKind : std::uint8_t {
  // Control planes.
  kLeaderKilled,
  kLeaderStopped,  // as by SIGSTOP: it comes back and does not know yet
  kLeaderCutFromStore,
  kFollowerKilled,
  // The store.
  kStoreSlow,
  kStoreFull,
  kAnswerLost,  // the answer to a write that is carried out, or is not
  kLeaseRevoked,
  kOldBackup,  // put back under the running world, once
  // The world.
  kAgentDies,
  kScale,
  // Those between control planes and hosts, and those that take regions from the world: one at a time.
  kLeaderCutFromHosts,
  kLeaderCutFromHost,
  kLeaderDeaf,  // it hears no host, and they hear it
  kLeaderMute,
  kHostCutFromFollower,
  kLeaderCutOffWithHost,  // the two hear each other, and nobody else hears them
  kRevokedAndCutOff,      // the same, and its lease is revoked early at that moment
  kWorkerDies,
  kHostCrashes,
  kHostCutOff,
  // Wall clocks of control planes' hosts, by hours and back.
  kLeaderClockMoved,
  kFollowerClockMoved
};
inline constexpr std::size_t kLeaderFaultKinds = 23;
inline constexpr std::array<const char*, kLeaderFaultKinds> kLeaderFaultNames = {"leader killed",
                                                                                 "leader stopped",
                                                                                 "leader cut from store",
                                                                                 "follower killed",
                                                                                 "store slow",
                                                                                 "store full",
                                                                                 "answer of a write lost",
                                                                                 "lease revoked early",
                                                                                 "old backup",
                                                                                 "agent dies",
                                                                                 "scale",
                                                                                 "leader cut from hosts",
                                                                                 "leader cut from a host",
                                                                                 "leader hears no host",
                                                                                 "leader heard by no host",
                                                                                 "host cut from a follower",
                                                                                 "leader cut off with a host",
                                                                                 "the same, lease revoked early",
                                                                                 "worker dies",
                                                                                 "host crashes",
                                                                                 "host cut off",
                                                                                 "leader clock moved",
                                                                                 "follower clock moved"};

using LeaderFault = DrawnFault<LeaderFaultKind>;

struct LeaderScenario {
  std::uint64_t seed = 0;
  DeploymentOptions options;
  int balls = 0;
  std::vector<LeaderFault> faults;
};

struct LeaderOutcome {
  std::vector<std::string> problems;
  std::array<std::uint64_t, kLeaderFaultKinds> faults{};  // that were caused
  std::uint64_t steps = 0, takeovers = 0;
  std::uint64_t elections = 0;  // leaders after the first
  std::vector<Micros> gaps;     // in which nobody led
  Micros stood = 0;             // the longest time in which not all regions stepped
  std::uint64_t two_owners = 0, lies = 0, lost_changes = 0, acknowledged = 0, lost_bodies = 0;
  std::uint64_t ended = 0;  // times that the world was said to be over, which nobody ended; among the lies
  std::uint64_t hash = 0;
};

// A control plane knows of a step from reports, of which there are two to four a second.
inline constexpr WordBounds kLeaderBounds = {.no_step = Milliseconds(500), .at_most = Milliseconds(2000)};

LeaderScenario DrawLeaders(std::uint64_t seed);
std::string Describe(const LeaderScenario& scenario);
LeaderOutcome Run(const LeaderScenario& scenario);

}  // namespace tessera::simulation
