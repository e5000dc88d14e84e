// Reconciler: leads an instance on, step by step, as far as the facts allow. Each step is a record that one of the
// parts proposes from the record of now; it is stored before anything follows from it.
//
// Failures are dealt with first, then changes that were asked for, then players who vanished, then the instance's life.
// A step that cannot be stored is not taken, and the timer comes back to it. Thread rule: as Cluster.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/cluster/failovers.h"
#include "control_plane/cluster/instance_checkpoints.h"
#include "control_plane/cluster/instance_players.h"
#include "control_plane/cluster/instances.h"
#include "control_plane/cluster/planned_changes.h"
#include "control_plane/cluster/worker_reports.h"
#include "control_plane/now.h"

namespace tessera::control {

// The parts that propose steps. They outlive the Reconciler.
struct SteppingParts {
  Instances& instances;
  PlannedChanges& changes;
  Failovers& failovers;
  InstanceCheckpoints& checkpoints;
  InstancePlayers& players;
};

class Reconciler {
 public:
  Reconciler(ClusterState& state, SteppingParts parts) : state_(state), parts_(parts) {}

  void Reconcile(Now now, InstanceEntry& instance);
  void Reconcile(Now now, const InstanceNumbers& touched);
  // Stores a step, and does what follows from it.
  absl::Status Enter(Now now, InstanceEntry& instance, const records::Instance& next);

 private:
  // An instance after one step.
  struct Step {
    Step(records::Instance next) : record(std::move(next)) {}  // NOLINT(google-explicit-constructor): most are this
    Step(records::Instance next, std::optional<Players> with) : record(std::move(next)), players(std::move(with)) {}
    records::Instance record;
    std::optional<Players> players;  // nothing: they stay
  };

  absl::Status Enter(Now now, InstanceEntry& instance, const Step& step);
  // Nothing if there is none to take.
  std::optional<Step> NextStep(Now now, InstanceEntry& instance);
  std::optional<Step> NextFailoverOrChange(Now now, InstanceEntry& instance);

  ClusterState& state_;
  SteppingParts parts_;
};

}  // namespace tessera::control
