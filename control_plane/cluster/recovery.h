// Recovery: takes up what runs, after the store was made of a backup, or where records of it could not be read.
//
// The backup may be old: worlds were made, scaled, ended and joined since. So nothing is ordered until the hosts have
// said what they run: their agents hold the orders, and these are the record. Meanwhile every worker that asks has its
// lease renewed, nothing is declared dead, and commands are refused. It ends when every host of the backup has
// answered, or after kRecoverPatience; those that have not are then silent hosts like any other.
//
// Worlds that run are taken up as they run, none is set back. One that the backup has and no host runs, though all its
// hosts have answered, ended since: it is not begun again unasked. One that the backup does not know is left as it is:
// its workers are ordered on as they were, under their host, until somebody ends them.
//
// Orders of a life that the store does not know show that this backup, or an older one, was begun from before. Then all
// numbers of what is taken up are raised once more.
//
// A world that is RUNNING by its record is called so only once reports show that all of its regions step; until then it
// is DEGRADED.
//
// Where records could not be read, the others are as new as what runs, and stay as they are: only players that were set
// aside are taken from the orders, and worlds that were are left as those that the backup does not know.
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "control_plane/adopt.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"
#include "tessera/v1/agent_link.pb.h"

namespace tessera::control {

class Recovery {
 public:
  // `now`: of the start, from which its patience counts.
  Recovery(ClusterState& state, Now now);

  bool active() const { return state_.recovering(); }

  void TakeOrders(const HostEntry& host, const v1::HeldOrders& held);
  // A worker of it runs, or ran and has died: it was not ended since the backup. An agent that began anew since it was
  // last ordered says this much of what it adopted, and no more.
  void NoteAlive(const v1::WorkerIdentity& identity) { alive_.insert(identity.instance_id()); }
  void NoteReport(const v1::WorkerReport& report, Now now);
  // Says of each world whether it is known to step. Call it about every kTimerInterval.
  void NoteHealth(Now now);
  // Ends it if that is due. True: it has ended, and the cluster goes on.
  bool Step(Now now);

 private:
  struct Stepped {
    std::uint64_t tick = 0;
    std::optional<Steady> at;  // when it was last seen to have made one more
  };
  bool Due(Now now) const;
  bool KnownToStep(const records::Instance& record, Now now) const;
  bool AllHostsAnswered(const records::Instance& record) const;
  bool AllAnswered() const;
  void EndMissing(InstanceEntry& instance, const std::vector<HeldOrder>& orders);
  absl::Status TakeUp(InstanceEntry& instance, const std::vector<HeldOrder>& orders, Now now);
  absl::Status EndUnlessItRuns(InstanceEntry& instance, Now now);
  absl::Status TakeUpPlayers(InstanceEntry& instance, const std::vector<HeldOrder>& orders, Now now);
  absl::Status KeepUnknown();

  ClusterState& state_;
  const Steady begun_;
  std::map<std::uint64_t, std::vector<v1::WorkerOrder>> held_;       // by the number of the host
  std::set<std::string> alive_;                                      // instances
  std::map<std::string, std::map<std::uint32_t, Stepped>> stepped_;  // by instance and region
  std::map<std::string, CopiesHeld> copies_;                         // by instance
  std::string trouble_;                                              // why it cannot end; logged once
};

// Whether the host runs this worker of a world that nobody knows.
bool IsUnknownWorker(const HostEntry& host, const v1::WorkerIdentity& identity);
// The workers of such a world are not ordered any more. False: there are none.
absl::StatusOr<bool> ForgetUnknown(ClusterState& state, const std::string& instance_id);
// The same for one worker that has ended.
void ForgetUnknownWorker(ClusterState& state, HostEntry& host, const v1::WorkerIdentity& identity);

}  // namespace tessera::control
