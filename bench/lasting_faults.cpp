#include "bench/lasting_faults.h"

#include <signal.h>

#include <algorithm>
#include <array>
#include <random>

#include "absl/strings/str_cat.h"
#include "host/process.h"

namespace tessera::bench {
namespace {

using Kind = LastingFaultKind;
using Program = LastingStage::Program;

constexpr std::array<const char*, static_cast<std::size_t>(kLastLastingFault) + 1> kLastingFaultNames = {
    "kill-leader", "stop-leader", "cut-leader",  "lose-leader", "cut-leader-with-host",
    "kill-store",  "stop-store",  "kill-worker", "kill-agent",  "freeze-host",
    "cut-host",    "orphan",      "slow-store",  "full-store",  "full-disk"};
// How long a fault holds at least and at most; a slow store's is fixed.
constexpr double kShortestHold_s = 2, kLongestHold_s = 8, kSlowStore_s = 2;

// The first host from `first` on that runs a worker loses one.
absl::Status KillWorker(const LastingStage& stage, std::uint32_t first) {
  for (std::uint32_t i = 0; i < kLastingHosts; ++i) {
    for (const LastingStage::Worker& worker : stage.WorkersOn((first + i) % kLastingHosts)) {
      const auto process = host::Process::Adopt(worker.pid, worker.start_time);
      if (!process.ok()) continue;
      process->Signal(SIGKILL);
      return absl::OkStatus();
    }
  }
  return absl::UnavailableError("no worker runs on any host");
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
    fault.hold_s =
        fault.kind == Kind::kSlowStore ? kSlowStore_s : kShortestHold_s + share * (kLongestHold_s - kShortestHold_s);
    faults.push_back(fault);
  }
  return faults;
}

absl::Status Strike(LastingFault& fault, LastingStage& stage) {
  const auto leader = stage.Leader();
  if (!leader) return absl::UnavailableError("nobody leads");
  fault.leader = *leader;
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
  }
  return absl::InternalError("no such fault");
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
      return stage.SetStoreFull(false);
    case Kind::kFullDisk:
      stage.disk(fault.which).Free();
      return absl::OkStatus();
  }
  return absl::InternalError("no such fault");
}

}  // namespace tessera::bench
