// LastingStage: a cluster that cannot be lost, on one machine: three machines with a control plane and a member of etcd
// each, three hosts, and a world with a region on each of them. Every machine is a network namespace; any of its
// programs can be killed or stopped, and any link cut, one way or both. Each host has a disk of its own, which can be
// filled, and so can the store; and a member of etcd can have a disk that is slow to write for good. Where it is wanted
// so, one control plane alone keeps its store in SQLite instead, on a disk of its own.
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
#include "bench/etcd_alarm.grpc.pb.h"
#include "bench/slow_fsync.h"
#include "bench/small_disk.h"
#include "control_plane/etcd/etcd_client.h"
#include "host/child_process.h"
#include "local_cluster/host_network.h"
#include "trust/credentials.h"

namespace tessera::bench {

inline constexpr std::uint32_t kLastingControls = 3, kLastingHosts = 3;
// As etcd has it unless it is told.
inline constexpr std::chrono::milliseconds kEtcdElection{1000};

struct LastingSetup {
  std::chrono::milliseconds election = kEtcdElection;  // so long etcd's members do without a leader before they elect
  bool etcd = true;                                    // false: one control plane on SQLite
};

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
  static absl::StatusOr<std::unique_ptr<LastingStage>> Start(const local::HostNetwork& network,
                                                             const std::string& folder, LastingSetup setup);
  ~LastingStage();
  LastingStage(const LastingStage&) = delete;
  LastingStage& operator=(const LastingStage&) = delete;

  // All control planes, for operators with all rights, and for players.
  const trust::ControlPoint& control() const { return control_; }
  const std::string& players() const { return players_; }
  const control::EtcdClient* etcd() const { return etcd_.get(); }  // null: there is none
  std::uint32_t controls() const { return setup_.etcd ? kLastingControls : 1; }
  static const char* prefix() { return "lasting"; }
  const local::HostNetwork& network() const { return network_; }
  static std::uint32_t MachineOf(std::uint32_t host) { return kLastingControls + host; }
  // As the cluster knows it: "host-1" is the first.
  static std::string NameOfHost(std::uint32_t host);
  static std::optional<std::uint32_t> HostNamed(const std::string& name);  // nothing: it is none of these

  // As etcd says; nothing while nobody leads. The only one leads always.
  std::optional<std::uint32_t> Leader() const;
  // The leader of etcd's members, as they say; nothing while none of them is known to lead.
  std::optional<std::uint32_t> StoreLeader() const;
  std::vector<Worker> WorkersOn(std::uint32_t host) const;

  void Signal(Program program, std::uint32_t which, int signal) const;
  void Kill(Program program, std::uint32_t which);
  // One that was killed comes back with what it had stored; one that runs is let be.
  absl::Status Restart(Program program, std::uint32_t which);
  // The agent and all its workers.
  void SignalHost(std::uint32_t host, int signal) const;
  // The disk of a host's agent, with all that its workers write.
  const SmallDisk& disk(std::uint32_t host) const { return *disks_.at(host); }
  // etcd takes no write of anybody, as it does when its space is used up, or takes them again. SQLite's disk is full.
  absl::Status SetStoreFull(bool full) const;
  // Each fsync of this member of etcd takes so much longer; 0: as long as its disk needs.
  void SlowStore(std::uint32_t member, std::chrono::milliseconds fsync) const { slow_.at(member)->SetDelay(fsync); }
  // All that is stored, to a file, by whoever leads.
  absl::Status BackUp(const std::string& file) const;
  // All control planes have ended: what the store holds is gone, and a backup is in its place.
  absl::Status BeginFrom(const std::string& backup) const;
  // The last lines of the program's log.
  std::string LastWords(Program program, std::uint32_t which) const;

 private:
  LastingStage(const local::HostNetwork& network, std::string folder, LastingSetup setup)
      : network_(network), folder_(std::move(folder)), setup_(setup) {}
  absl::Status StartEtcd();
  absl::Status ConnectEtcd();
  absl::Status MakeEtcdCertificate() const;
  absl::Status RunToItsEnd(const std::vector<std::string>& argv, const char* log) const;
  absl::Status Launch(Program program, std::uint32_t which);
  absl::Status Await(Program program, std::uint32_t which);
  absl::Status StartControls();
  absl::Status TakeRights();
  absl::Status StartHosts();
  std::vector<std::string> Arguments(Program program, std::uint32_t which) const;
  std::string Path(Program program, std::uint32_t which, const char* after) const;
  std::string EtcdEndpoints() const;
  absl::StatusOr<std::unique_ptr<etcdserverpb::Maintenance::Stub>> Maintenance(std::uint32_t member) const;
  host::ChildProcess& process(Program program, std::uint32_t which) const;

  const local::HostNetwork& network_;
  const std::string folder_;
  const LastingSetup setup_;
  std::unique_ptr<control::EtcdClient> etcd_;
  trust::ControlPoint control_;
  std::string players_;
  std::array<std::unique_ptr<SmallDisk>, kLastingHosts> disks_;
  std::unique_ptr<SmallDisk> store_disk_;                                              // SQLite's
  std::array<std::unique_ptr<SlowFsync>, kLastingControls> slow_;                      // etcd's
  mutable std::array<std::array<std::optional<host::ChildProcess>, 3>, 3> processes_;  // by program
};

}  // namespace tessera::bench
