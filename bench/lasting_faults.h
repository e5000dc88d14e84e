// LastingFaults: what strikes the cluster of the suite lasting, drawn from a seed.
//
//   for (LastingFault& fault : DrawFaults(seed, 20)) {
//     Aim(fault, stage);
//     Strike(fault, stage);
//     ... it holds for fault.hold_s; a third of it later, where StrikesTwice(fault.kind): StrikeAgain(fault, stage) ...
//     Mend(fault, stage);
//   }
//
// Thread rule: the stage's.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
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
  kStoreMember,        // a worker dies with a member of etcd that follows, and the other that follows is slow to write
  kStoreLeader,        // a worker dies with the member of etcd that leads
  kFullStoreMinute,    // the store takes no write for a minute, and workers die on two hosts, one after the other
  kCutBorder,          // the link between two hosts whose regions are neighbours, both ways; others hear both
  kOldBackup,          // all control planes and what is stored are lost, and a backup of some faults ago is taken up
};
inline constexpr LastingFaultKind kLastLastingFault = LastingFaultKind::kOldBackup;
const char* NameOf(LastingFaultKind kind);

struct LastingFault {
  LastingFaultKind kind = LastingFaultKind::kKillLeader;
  std::uint32_t which = 0;  // member, host, or place among the workers of a host
  double hold_s = 0;
  // Set by Aim.
  std::uint32_t leader = 0;                        // the control plane that leads
  std::uint32_t store_leader = 0, store_slow = 0;  // members of etcd: that leads; that is to be slow
  std::uint32_t store_killed = 0;
  std::uint32_t struck_host = 0;  // that lost a worker first; set by Strike
  // To be set before Strike: of kOldBackup a file to begin from, and a function that returns once all that the store
  // holds is written down, since its keys are its record of who wrote; of kCutBorder two hosts.
  std::string backup{};
  std::function<absl::Status()> recorded{};
  std::pair<std::uint32_t, std::uint32_t> border{};
};

// Each kind comes once before any comes again, so that a short run has as many kinds as faults. The same seed draws the
// same faults.
std::vector<LastingFault> DrawFaults(std::uint64_t seed, std::size_t count);

// True if a second blow belongs to it, some time after the first.
bool StrikesTwice(LastingFaultKind kind);

// Finds whom to strike, as things are now. UNAVAILABLE: nobody leads.
absl::Status Aim(LastingFault& fault, const LastingStage& stage);
// UNAVAILABLE: no worker runs, which is to be struck, or no store can be restored, or not all of it is written down.
absl::Status Strike(LastingFault& fault, LastingStage& stage);
absl::Status StrikeAgain(const LastingFault& fault, const LastingStage& stage);
// All is as before, as far as it can be mended from outside.
absl::Status Mend(const LastingFault& fault, LastingStage& stage);

}  // namespace tessera::bench
