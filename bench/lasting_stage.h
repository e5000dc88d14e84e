// LastingStage: a cluster that cannot be lost, on one machine: three machines with a control plane and a member of etcd
// each, three hosts, and a world with a region on each of them. Every machine is a network namespace; any of its
// programs can be killed or stopped, and any link cut, one way or both. Each host has a disk of its own, which can be
// filled, and so can the store.
//
//   auto stage = LastingStage::Start(network, folder);
//   (*stage)->Kill(Program::kControl, 0);
//   (*stage)->Restart(Program::kControl, 0);
//
// Thread rule: one thread starts, strikes and ends it; `control`, `WorkersOn` from any.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "bench/small_disk.h"
#include "control_plane/etcd/etcd_client.h"
#include "host/child_process.h"
#include "local_cluster/host_network.h"
#include "trust/credentials.h"

namespace tessera::bench {

inline constexpr std::uint32_t kLastingControls = 3, kLastingHosts = 3;
// As etcd has it unless it is told.
inline constexpr std::chrono::milliseconds kEtcdElection{1000};

class LastingStage {
 public:
  enum class Program { kControl, kEtcd, kAgent };
  // A worker that a host's agent keeps.
  struct Worker {
    std::string name;  // "inst-1/2#7": instance, region, incarnation
    std::uint32_t region = 0;
    pid_t pid = 0;
    std::uint64_t start_time = 0;
    std::uint16_t metrics_port = 0;
  };

  // The machines that a network for it needs.
  static constexpr std::uint32_t kMachines = kLastingControls + kLastingHosts;

  // Everything runs, hosts are READY; there is no world yet. `network` outlives it; `folder` is empty. Errors say which
  // program did not come up, with its last lines.
  // `election`: how long etcd's members do without a leader before they elect another.
  static absl::StatusOr<std::unique_ptr<LastingStage>> Start(const local::HostNetwork& network,
                                                             const std::string& folder,
                                                             std::chrono::milliseconds election = kEtcdElection);
  ~LastingStage();
  LastingStage(const LastingStage&) = delete;
  LastingStage& operator=(const LastingStage&) = delete;

  // All control planes, for operators with all rights, and for players.
  const trust::ControlPoint& control() const { return control_; }
  const std::string& players() const { return players_; }
  const control::EtcdClient& etcd() const { return *etcd_; }
  static const char* prefix() { return "lasting"; }
  const local::HostNetwork& network() const { return network_; }
  static std::uint32_t MachineOf(std::uint32_t host) { return kLastingControls + host; }

  // As etcd says; nothing while nobody leads.
  std::optional<std::uint32_t> Leader() const;
  std::vector<Worker> WorkersOn(std::uint32_t host) const;

  void Signal(Program program, std::uint32_t which, int signal) const;
  void Kill(Program program, std::uint32_t which);
  // One that was killed comes back with what it had stored; one that runs is let be.
  absl::Status Restart(Program program, std::uint32_t which);
  // The agent and all its workers.
  void SignalHost(std::uint32_t host, int signal) const;
  // The disk of a host's agent, with all that its workers write.
  const SmallDisk& disk(std::uint32_t host) const { return *disks_.at(host); }
  // etcd takes no write of anybody, as it does when its space is used up, or takes them again.
  absl::Status SetStoreFull(bool full) const;
  // The last lines of the program's log.
  std::string LastWords(Program program, std::uint32_t which) const;

 private:
  LastingStage(const local::HostNetwork& network, std::string folder, std::chrono::milliseconds election)
      : network_(network), folder_(std::move(folder)), election_(election) {}
  absl::Status MakeEtcdCertificate() const;
  absl::Status Launch(Program program, std::uint32_t which);
  absl::Status Await(Program program, std::uint32_t which);
  absl::Status StartControls();
  absl::Status TakeRights();
  absl::Status StartHosts();
  std::vector<std::string> Arguments(Program program, std::uint32_t which) const;
  std::string Path(Program program, std::uint32_t which, const char* after) const;
  std::string EtcdEndpoints() const;
  host::ChildProcess& process(Program program, std::uint32_t which) const;

  const local::HostNetwork& network_;
  const std::string folder_;
  const std::chrono::milliseconds election_;
  std::unique_ptr<control::EtcdClient> etcd_;
  trust::ControlPoint control_;
  std::string players_;
  std::array<std::unique_ptr<SmallDisk>, kLastingHosts> disks_;
  mutable std::array<std::array<std::optional<host::ChildProcess>, 3>, 3> processes_;  // by program
};

}  // namespace tessera::bench
