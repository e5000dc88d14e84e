// Candidate: one of several control planes of a cluster. It follows while another leads, and leads while it is elected.
//
//   follow: the doors answer with the leader's address (follower_server.h), the election is tried again and again
//   lead:   a Reign over an EtcdStore; it ends with the lease, or when a write shows that somebody else leads
//
// Between the two the doors are closed for a moment; callers try again. It goes back from leading to following without
// ending the process, however often.
//
// Thread rule: one thread runs it.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "control_plane/etcd/etcd_client.h"
#include "control_plane/etcd/etcd_election.h"
#include "control_plane/follower_server.h"
#include "control_plane/reign.h"

namespace tessera::control {

class Candidate {
 public:
  // `self`: where others reach the doors. All but the settings outlive it.
  Candidate(const EtcdClient& client, std::string prefix, const LeaderAddress& self, ReignSettings settings,
            ControlMetrics& metrics, const Pages& pages, ElectionTimes times = {});

  // Runs until `ended`, which is asked several times a second, and then gives up what it leads. `ready` is called once:
  // when the doors are open for the first time, its error ends the run. Other errors: those that no other attempt
  // mends, as FAILED_PRECONDITION and DATA_LOSS of the store. While etcd does not answer it tries again for ever.
  absl::Status Run(const std::function<bool()>& ended, const std::function<absl::Status()>& ready);

 private:
  absl::StatusOr<EtcdFence> Follow(const std::function<bool()>& ended);
  absl::Status OpenFollowersDoors();
  absl::Status Lead(const EtcdFence& fence, const std::function<bool()>& ended);
  absl::Status Ready();
  bool HasTcpDoor() const { return !settings_.doors.operators.empty() || !settings_.doors.players.empty(); }

  const EtcdClient& client_;
  const std::string prefix_;
  const ReignSettings settings_;
  ControlMetrics& metrics_;
  const Pages pages_;
  EtcdElection election_;
  std::function<absl::Status()> ready_;  // empty once it was called
  std::unique_ptr<FollowerServer> doors_;

  std::mutex mutex_;  // guards what follows
  std::optional<LeaderAddress> leader_;
};

}  // namespace tessera::control
