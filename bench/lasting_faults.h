// LastingFaults: what strikes the cluster of the suite lasting, drawn from a seed.
//
//   for (const LastingFault& fault : DrawFaults(seed, 20)) {
//     Strike(fault, stage);
//     ... it holds for fault.hold_s ...
//     Mend(fault, stage);
//   }
//
// Thread rule: the stage's.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "bench/lasting_stage.h"

namespace tessera::bench {

enum class LastingFaultKind {
  kKillLeader,         // the control plane that leads, kill -9
  kStopLeader,         // it stands still and goes on, as if nothing had been
  kCutLeader,          // its machine's link, both ways
  kLoseLeader,         // messages from its machine to the others are lost; theirs arrive
  kCutLeaderWithHost,  // its machine and a host from all others, not from each other
  kKillStore,          // a member of etcd, kill -9
  kStopStore,          // a member of etcd stands still
  kKillWorker,         // a region's worker, kill -9
  kKillAgent,          // an agent alone; its workers run on
  kFreezeHost,         // an agent and all its workers stand still, and go on when others took their place
  kCutHost,            // a host's link, both ways
  kOrphan,             // a worker dies together with the leader
  kSlowStore,          // a worker dies, and two of three members of etcd stand still for 2 s
  kFullStore,          // a worker dies, and etcd takes no write, as when its space is used up
  kFullDisk,           // a worker dies, and the disk of its host's agent is full
};
inline constexpr LastingFaultKind kLastLastingFault = LastingFaultKind::kFullDisk;
const char* NameOf(LastingFaultKind kind);

struct LastingFault {
  LastingFaultKind kind = LastingFaultKind::kKillLeader;
  std::uint32_t which = 0;  // member, host, or place among the workers of a host
  double hold_s = 0;
  std::uint32_t leader = 0;  // the one that led when it struck; set by Strike
};

// Each kind comes once before any comes again, so that a short run has as many kinds as faults. The same seed draws the
// same faults.
std::vector<LastingFault> DrawFaults(std::uint64_t seed, std::size_t count);

// UNAVAILABLE: nobody leads, or no worker runs, which is to be struck.
absl::Status Strike(LastingFault& fault, LastingStage& stage);
// All is as before, as far as it can be mended from outside.
absl::Status Mend(const LastingFault& fault, LastingStage& stage);

}  // namespace tessera::bench
