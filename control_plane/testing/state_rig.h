// StateRig: a ClusterState with hosts and instances in it, for tests of one part without the others. There are no
// agents and no messages; a test writes what is known of workers into their entries.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "control_plane/cluster/cluster_state.h"
#include "control_plane/control_settings.h"
#include "control_plane/memory_store.h"
#include "control_plane/now.h"

namespace tessera::control {

class StateRig {
 public:
  StateRig();

  // A host whose agent was admitted and has just been heard.
  HostEntry& AddHost(const std::string& name, std::uint32_t capacity = 8);
  // A RUNNING instance with a region on each of `hosts`, in their order. All workers run by its map, at tick 100, and
  // standbys hold whole copies of their primaries.
  InstanceEntry& AddRunning(const std::vector<HostEntry*>& hosts);
  // Time passes, and all hosts are heard.
  void Pass(std::chrono::milliseconds span);

  static WorkerEntry& WorkerOf(InstanceEntry& instance, std::uint32_t region);
  static v1::WorkerIdentity IdentityOf(const InstanceEntry& instance, const WorkerEntry& worker);

  MemoryStore store;
  std::unique_ptr<ClusterState> state;
  ControlSettings settings;
  Now now{std::chrono::hours(1), std::chrono::hours(24 * 365 * 50)};
};

}  // namespace tessera::control
