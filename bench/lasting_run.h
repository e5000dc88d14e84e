// LastingRun: faults strike a cluster one after the other, each when the cluster is well again after the one before,
// and the history of it is judged.
//
//   auto run = RunLasting(network, {.faults = DrawFaults(7, 12)});
//   if (run.ok()) Print(run->lost, run->two_writers, ...);
//
// Thread rule: one thread, which was in its own network and mounts (local::EnterOwnNetwork, EnterOwnMounts) before any
// other thread was made.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "bench/lasting_faults.h"
#include "bench/lasting_history.h"
#include "local_cluster/host_network.h"

namespace tessera::bench {

struct LastingPlan {
  std::vector<LastingFault> faults;
  std::uint32_t players = 1;
  std::uint32_t bodies = 40;
  LastingSetup setup{};
  // How long one fault may take until all is well again.
  std::chrono::seconds patience{120};
  std::function<void(const std::string&)> tell = [](const std::string&) {};  // a line for people, as it goes
};

// How long it took after one fault; negative: it is not of this fault, or never came.
struct LastingGap {
  LastingFaultKind kind = LastingFaultKind::kKillLeader;
  double leader_s = -1;    // until a change that was asked for after the strike was acknowledged
  double failover_s = -1;  // after a worker's death: until all regions of a later map stepped
  double orphan_s = -1;    // the same, from when somebody leads again
  // Times of the history: the strike, its end, and all was well again, or it was given up.
  double struck = 0, mended = 0, well = 0;
  double false_running_s = 0, false_degraded_s = 0;  // said in that time
  std::optional<HostCut> cut{};                      // the fault is kCutBorder
  CutOutcome cut_outcome{};
};

struct LastingVerdict {
  std::vector<std::string> lost, two_writers, two_owners, players_dropped;
  Falsehood false_running, false_degraded;
  std::vector<LastingGap> gaps;
  std::vector<std::string> cuts_not_told;  // neighbours that were cut from each other, and neither named nor moved
  std::vector<std::string> not_well;       // faults after which the cluster was not well again in time, and why
  std::size_t changes = 0, writes = 0, readings = 0;
  double late_s = 0;  // as the history's
};

// An error: the cluster could not be started, or a fault could not strike.
absl::StatusOr<LastingVerdict> RunLasting(const local::HostNetwork& network, LastingPlan plan);

}  // namespace tessera::bench
