#include "bench/lasting_faults.h"

#include <signal.h>

#include <algorithm>
#include <array>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "host/process.h"

namespace tessera::bench {
namespace {

using Kind = LastingFaultKind;
using Program = LastingStage::Program;

constexpr std::array<const char*, static_cast<std::size_t>(kLastLastingFault) + 1> kLastingFaultNames = {
    "kill-leader",  "stop-leader",  "cut-leader",        "lose-leader", "cut-leader-with-host",
    "kill-store",   "stop-store",   "kill-worker",       "kill-agent",  "freeze-host",
    "cut-host",     "orphan",       "slow-store",        "full-store",  "full-disk",
    "store-member", "store-leader", "full-store-minute", "cut-border",  "old-backup"};
// How long a fault holds at least and at most; those of a store are fixed.
constexpr double kShortestHold_s = 2, kLongestHold_s = 8, kSlowStore_s = 2, kFullMinute_s = 60;
// A link that lasts: it is routed around within 18 s (docs/decisions/0067).
constexpr double kCutBorder_s = 30;
constexpr std::chrono::milliseconds kSlowFsync{100};

double HoldOf(Kind kind, double share) {
  if (kind == Kind::kSlowStore) return kSlowStore_s;
  if (kind == Kind::kFullStoreMinute) return kFullMinute_s;
  if (kind == Kind::kCutBorder) return kCutBorder_s;
  return kShortestHold_s + share * (kLongestHold_s - kShortestHold_s);
}

// The first of so many hosts from `first` on that runs a worker loses one; which host that is.
absl::StatusOr<std::uint32_t> KillWorkerOn(const LastingStage& stage, std::uint32_t first, std::uint32_t hosts) {
  for (std::uint32_t i = 0; i < hosts; ++i) {
    const std::uint32_t host = (first + i) % kLastingHosts;
    for (const LastingStage::Worker& worker : stage.WorkersOn(host)) {
      const auto process = host::Process::Adopt(worker.pid, worker.start_time);
      if (!process.ok()) continue;
      process->Signal(SIGKILL);
      return host;
    }
  }
  return absl::UnavailableError("no worker runs on any host");
}

absl::Status KillWorker(const LastingStage& stage, std::uint32_t first) {
  return KillWorkerOn(stage, first, kLastingHosts).status();
}

absl::Status BeginFromBackup(const LastingFault& fault, LastingStage& stage) {
  for (std::uint32_t i = 0; i < stage.controls(); ++i) stage.Kill(Program::kControl, i);
  if (absl::Status status = fault.recorded(); !status.ok()) return status;
  return stage.BeginFrom(fault.backup);
}

// `mend`: the other way round.
absl::Status CutBorder(const LastingStage& stage, const LastingFault& fault, bool mend) {
  const std::uint32_t one = LastingStage::MachineOf(fault.border.first);
  const std::uint32_t other = LastingStage::MachineOf(fault.border.second);
  for (const auto& [from, to] : {std::pair(one, other), std::pair(other, one)}) {
    absl::Status status = mend ? stage.network().Find(from, to) : stage.network().Lose(from, to);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

// `mend`: the other way round.
absl::Status PartFromOthers(const LastingStage& stage, std::uint32_t leader, std::uint32_t host, bool mend) {
  const std::uint32_t with = LastingStage::MachineOf(host);
  for (const std::uint32_t inside : {leader, with}) {
    for (std::uint32_t outside = 0; outside < LastingStage::kMachines; ++outside) {
      if (outside == leader || outside == with) continue;
      for (const auto& [from, to] : {std::pair(inside, outside), std::pair(outside, inside)}) {
        absl::Status status = mend ? stage.network().Find(from, to) : stage.network().Lose(from, to);
        if (!status.ok()) return status;
      }
    }
  }
  return absl::OkStatus();
}

absl::Status LoseFrom(const LastingStage& stage, std::uint32_t machine, bool mend) {
  for (std::uint32_t to = 0; to < LastingStage::kMachines; ++to) {
    if (to == machine) continue;
    absl::Status status = mend ? stage.network().Find(machine, to) : stage.network().Lose(machine, to);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

void SignalTwoStores(const LastingStage& stage, std::uint32_t other, int signal) {
  for (std::uint32_t i = 0; i < kLastingControls; ++i) {
    if (i != other) stage.Signal(Program::kEtcd, i, signal);
  }
}

}  // namespace

const char* NameOf(LastingFaultKind kind) { return kLastingFaultNames.at(static_cast<std::size_t>(kind)); }

std::vector<LastingFault> DrawFaults(std::uint64_t seed, std::size_t count) {
  std::mt19937_64 random(seed);
  // Not by distributions, of which each library has its own.
  const auto draw = [&](std::uint64_t below) { return random() % below; };
  std::vector<LastingFault> faults;
  std::vector<Kind> left;
  while (faults.size() < count) {
    if (left.empty()) {
      for (std::size_t i = 0; i < kLastingFaultNames.size(); ++i) left.push_back(static_cast<Kind>(i));
    }
    const auto at = left.begin() + static_cast<std::ptrdiff_t>(draw(left.size()));
    LastingFault fault{.kind = *at, .which = static_cast<std::uint32_t>(draw(3))};
    left.erase(at);
    const double share = static_cast<double>(draw(1000)) / 1000;
    fault.hold_s = HoldOf(fault.kind, share);
    faults.push_back(fault);
  }
  return faults;
}

bool StrikesTwice(LastingFaultKind kind) { return kind == Kind::kFullStoreMinute; }

absl::Status Aim(LastingFault& fault, const LastingStage& stage) {
  const auto leader = stage.Leader();
  if (!leader) return absl::UnavailableError("nobody leads");
  fault.leader = *leader;
  if (fault.kind != Kind::kStoreMember && fault.kind != Kind::kStoreLeader) return absl::OkStatus();
  const auto store = stage.StoreLeader();
  if (!store) return absl::UnavailableError("nobody leads among etcd's members");
  // One of the two others dies, by `which`, and the last one is slow.
  fault.store_leader = *store;
  fault.store_killed = (*store + 1 + fault.which % 2) % kLastingControls;
  fault.store_slow = (*store + 2 - fault.which % 2) % kLastingControls;
  return absl::OkStatus();
}

absl::Status Strike(LastingFault& fault, LastingStage& stage) {
  switch (fault.kind) {
    case Kind::kKillLeader:
      stage.Kill(Program::kControl, fault.leader);
      return absl::OkStatus();
    case Kind::kStopLeader:
      stage.Signal(Program::kControl, fault.leader, SIGSTOP);
      return absl::OkStatus();
    case Kind::kCutLeader:
      return stage.network().Cut(fault.leader);
    case Kind::kLoseLeader:
      return LoseFrom(stage, fault.leader, false);
    case Kind::kCutLeaderWithHost:
      return PartFromOthers(stage, fault.leader, fault.which, false);
    case Kind::kKillStore:
      stage.Kill(Program::kEtcd, fault.which);
      return absl::OkStatus();
    case Kind::kStopStore:
      stage.Signal(Program::kEtcd, fault.which, SIGSTOP);
      return absl::OkStatus();
    case Kind::kKillWorker:
      return KillWorker(stage, fault.which);
    case Kind::kKillAgent:
      stage.Kill(Program::kAgent, fault.which);
      return absl::OkStatus();
    case Kind::kFreezeHost:
      stage.SignalHost(fault.which, SIGSTOP);
      return absl::OkStatus();
    case Kind::kCutHost:
      return stage.network().Cut(LastingStage::MachineOf(fault.which));
    case Kind::kOrphan:
      stage.Kill(Program::kControl, fault.leader);
      return KillWorker(stage, fault.which);
    case Kind::kSlowStore:
      SignalTwoStores(stage, fault.which, SIGSTOP);
      return KillWorker(stage, fault.which);
    case Kind::kFullStore:
      if (absl::Status status = stage.SetStoreFull(true); !status.ok()) return status;
      return KillWorker(stage, fault.which);
    case Kind::kFullDisk:
      if (absl::Status status = stage.disk(fault.which).Fill(); !status.ok()) return status;
      return KillWorker(stage, fault.which);
    case Kind::kStoreMember:
      stage.SlowStore(fault.store_slow, kSlowFsync);
      stage.Kill(Program::kEtcd, fault.store_killed);
      return KillWorker(stage, fault.which);
    case Kind::kStoreLeader:
      stage.Kill(Program::kEtcd, fault.store_leader);
      return KillWorker(stage, fault.which);
    case Kind::kFullStoreMinute: {
      if (absl::Status status = stage.SetStoreFull(true); !status.ok()) return status;
      const auto host = KillWorkerOn(stage, fault.which, kLastingHosts);
      if (host.ok()) fault.struck_host = *host;
      return host.status();
    }
    case Kind::kCutBorder:
      return CutBorder(stage, fault, false);
    case Kind::kOldBackup:
      return BeginFromBackup(fault, stage);
  }
  return absl::InternalError("no such fault");
}

absl::Status StrikeAgain(const LastingFault& fault, const LastingStage& stage) {
  return KillWorkerOn(stage, fault.struck_host + 1, kLastingHosts - 1).status();
}

absl::Status Mend(const LastingFault& fault, LastingStage& stage) {
  switch (fault.kind) {
    case Kind::kKillLeader:
    case Kind::kOrphan:
      return stage.Restart(Program::kControl, fault.leader);
    case Kind::kStopLeader:
      stage.Signal(Program::kControl, fault.leader, SIGCONT);
      return absl::OkStatus();
    case Kind::kCutLeader:
      return stage.network().Mend(fault.leader);
    case Kind::kLoseLeader:
      return LoseFrom(stage, fault.leader, true);
    case Kind::kCutLeaderWithHost:
      return PartFromOthers(stage, fault.leader, fault.which, true);
    case Kind::kKillStore:
      return stage.Restart(Program::kEtcd, fault.which);
    case Kind::kStopStore:
      stage.Signal(Program::kEtcd, fault.which, SIGCONT);
      return absl::OkStatus();
    case Kind::kKillWorker:
      return absl::OkStatus();
    case Kind::kKillAgent:
      return stage.Restart(Program::kAgent, fault.which);
    case Kind::kFreezeHost:
      stage.SignalHost(fault.which, SIGCONT);
      return absl::OkStatus();
    case Kind::kCutHost:
      return stage.network().Mend(LastingStage::MachineOf(fault.which));
    case Kind::kSlowStore:
      SignalTwoStores(stage, fault.which, SIGCONT);
      return absl::OkStatus();
    case Kind::kFullStore:
    case Kind::kFullStoreMinute:
      return stage.SetStoreFull(false);
    case Kind::kStoreMember:
      stage.SlowStore(fault.store_slow, std::chrono::milliseconds(0));
      return stage.Restart(Program::kEtcd, fault.store_killed);
    case Kind::kStoreLeader:
      return stage.Restart(Program::kEtcd, fault.store_leader);
    case Kind::kCutBorder:
      return CutBorder(stage, fault, true);
    case Kind::kOldBackup:
      for (std::uint32_t i = 0; i < stage.controls(); ++i) {
        if (absl::Status status = stage.Restart(Program::kControl, i); !status.ok()) return status;
      }
      return absl::OkStatus();
    case Kind::kFullDisk:
      stage.disk(fault.which).Free();
      return absl::OkStatus();
  }
  return absl::InternalError("no such fault");
}

}  // namespace tessera::bench
