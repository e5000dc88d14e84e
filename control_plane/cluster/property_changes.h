// PropertyChanges: changes of bodies' properties that somebody waits for. They are in the orders of all workers of an
// instance until one of them answers.
//
// None of it is stored: who waits asks again.
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

class PropertyChanges {
 public:
  explicit PropertyChanges(ClusterState& state) : state_(state) {}
  void Forget(std::uint64_t number) { pending_.erase(number); }

  // The number of the change, which the workers are asked for until it is forgotten; 0: only checked. Errors name the
  // field: what the body has already is known only to its owner.
  absl::StatusOr<std::uint64_t> Add(InstanceEntry& instance, const v1::SetPropertyRequest& request);
  // Nothing until a worker has answered. ABORTED: the instance does not run any more.
  std::optional<absl::Status> Outcome(const std::string& id, std::uint64_t change) const;
  void Remove(InstanceEntry& instance, std::uint64_t change);

  void TakeAnswers(const InstanceEntry& instance, const v1::WorkerReport& report);
  // Those without an answer, ascending by number.
  std::vector<v1::PropertyChange> Unanswered(const InstanceEntry& instance) const;

 private:
  struct Pending {
    v1::PropertyChange change;
    std::optional<absl::Status> outcome;
  };

  ClusterState& state_;
  std::map<std::uint64_t, std::vector<Pending>> pending_;  // by instance number; ascending by the change's number
};

}  // namespace tessera::control
