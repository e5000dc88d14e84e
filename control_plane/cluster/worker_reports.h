// WorkerReports: the census of workers by their agents' messages: reports, exits, and workers that a heartbeat names no
// longer.
//
// A worker that reports its public key gets a certificate for it, in its order: what it opens its ports with.
//
// Messages about another host's worker, or about an earlier incarnation, are ignored. Instances whose next step may
// depend on a message are added to `touched`, by number; the caller reconciles them.
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <optional>
#include <set>

#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"
#include "tessera/v1/agent_link.pb.h"

namespace tessera::control {

using ReportList = google::protobuf::RepeatedPtrField<v1::WorkerReport>;

class WorkerReports {
 public:
  explicit WorkerReports(ClusterState& state) : state_(state) {}

  struct Taken {
    InstanceEntry* instance = nullptr;
    v1::WorkerReport before;  // the worker's last report until now
  };
  std::optional<Taken> Take(const HostEntry& host, const v1::WorkerReport& report, InstanceNumbers& touched, Now now);

  // `reports` are all workers that the agent runs, by the desired set `acted_revision` if it says which one. A worker
  // that it was asked for and does not name has died unseen; one that was to end has ended.
  void NoticeAbsent(HostEntry& host, const ReportList& reports, std::optional<std::uint64_t> acted_revision,
                    InstanceNumbers& touched);

  // False: the host is not to run that worker.
  bool TakeExit(const HostEntry& host, const v1::WorkerExited& exited, InstanceNumbers& touched);

  // Nobody waits for workers of a lost host that were to end: should it come back, they are not in its desired set.
  void NoticeLost(const HostEntry& host, InstanceNumbers& touched);

 private:
  void Certify(const InstanceEntry& instance, WorkerEntry& worker, bool was_bound, const HostEntry& host);
  void StoreTakenOut(InstanceEntry& instance, const v1::WorkerReport& report);

  ClusterState& state_;
};

}  // namespace tessera::control
