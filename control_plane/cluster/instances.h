// Instances: the life of each instance, from its first placement until it is forgotten. The states are life.h's.
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "control_plane/cluster/cluster_state.h"
#include "control_plane/cluster/health_watch.h"
#include "control_plane/control_settings.h"
#include "control_plane/life.h"
#include "control_plane/now.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

class Instances {
 public:
  Instances(ClusterState& state, const ControlSettings& settings)
      : state_(state), settings_(settings), health_(state) {}

  // The instance was made or loaded.
  void Adopt(InstanceEntry& instance, Now now) const;

  // The next record by life.h; nothing if the facts allow no step. `waiting`: joins that wait for the workers.
  std::optional<records::Instance> NextInLife(const InstanceEntry& instance, int waiting, Now now) const;
  // The next record while PLACING: a lazy instance's places were reserved when it was made, but if a host of them is
  // not ready now, others are looked for.
  std::optional<records::Instance> NextPlaced(const InstanceEntry& instance, Now now) const;
  // The record of an instance that is to stop; nothing if it does already or has ended.
  static std::optional<records::Instance> NextStopped(const InstanceEntry& instance);

  // A step from `previous` is stored: does what follows from it, other than the next step.
  void Entered(InstanceEntry& instance, v1::InstanceState previous, Now now);
  // No step can be taken: notes whether the instance runs in good health. A fault that begins is an event.
  void NoteHealth(InstanceEntry& instance, Now now);
  void Forget(std::uint64_t number) { health_.Forget(number); }
  // Its workers start again: they are wanted in desired sets, and have as long for it as the first.
  void Restarted(InstanceEntry& instance, Now now) const {
    instance.withdrawn = false;
    instance.state_since = now.steady;
  }

  // Time passes: workers that do not end in order are in no desired set any more.
  void WithdrawLate(InstanceEntry& instance, Now now);
  // Time passes: forgets instances that ended long ago, the oldest first, and returns their numbers.
  std::vector<std::uint64_t> ForgetEnded(Now now);

 private:
  LifeFacts Facts(const InstanceEntry& instance, int waiting, Now now) const;
  void NoteFaults(InstanceEntry& instance, const HealthFaults& faults, Now now);
  void NoteWait(InstanceEntry& instance, Now now) const;
  void LogProgress(InstanceEntry& instance, Now now) const;

  ClusterState& state_;
  ControlSettings settings_;
  HealthWatch health_;
};

}  // namespace tessera::control
